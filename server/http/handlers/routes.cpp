#include "server/http/handlers/routes.h"

#include "server/http/access.h"
#include "server/http/handlers/handlers.h"
#include "tracer/encode.h"

namespace http {

using namespace handlers;  // NOLINT(google-build-using-namespace): the table names all of them

std::vector<Route> client_routes(const ApiContext& api_context) {
  const auto context = std::make_shared<const ApiContext>(api_context);
  const auto with_context = [&](Answer (*handler)(Request&, const ApiContext&)) -> Handler {
    return [context, handler](Request& request) { return handler(request, *context); };
  };
  const auto image = [&](const std::string& name) -> Handler {
    return [context, name](Request& request) { return get_image(request, *context, name); };
  };
  std::vector<Route> routes{
      {"GET", "/", get_root, {}},
      {"GET", "/openapi.json", get_openapi, {}},
      {"GET", "/docs", get_docs, {}},
      {"GET", "/v1/version", with_context(get_version), {}},
      {"POST", "/v1/jobs", with_context(submit_job), {}},
      {"GET", "/v1/jobs", with_context(list_jobs), {"state", "label", "batch", "q", "limit", "cursor"}},
      {"POST", "/v1/jobs/validate", with_context(validate_job), {}},
      {"POST", "/v1/render", with_context(render), {}},
      {"POST", "/v1/measure", with_context(measure), {}},
      {"GET", "/v1/jobs/{id}", with_context(get_job), {"wait"}},
      {"PATCH", "/v1/jobs/{id}", with_context(change_job), {}},
      {"DELETE", "/v1/jobs/{id}", with_context(remove_job), {}},
      {"POST", "/v1/jobs/{id}/cancel", with_context(cancel_job), {}},
      {"POST", "/v1/jobs/{id}/retry", with_context(retry_job), {}},
      {"GET", "/v1/jobs/{id}/preview", with_context(get_preview), {"max"}},
      {"GET", "/v1/jobs/{id}/events", with_context(get_job_events), {}},
      {"GET", "/v1/events", with_context(get_events), {}},
      {"POST", "/v1/batches", with_context(submit_batch), {}},
      {"GET", "/v1/batches/{id}", with_context(get_batch), {}},
      {"POST", "/v1/batches/{id}/cancel", with_context(cancel_batch), {}},
      {"POST", "/v1/batches/{id}/retry", with_context(retry_batch), {}},
      {"GET", "/v1/batches/{id}/artifacts.tar", with_context(get_batch_artifacts), {}},
      {"GET", "/v1/queue", with_context(get_queue), {}},
      {"GET", "/v1/jobs/{id}/deliveries", with_context(get_deliveries), {}},
      {"POST", "/v1/assets/missing", with_context(find_missing_assets), {}},
      {"PUT", "/v1/assets/{sha256}", with_context(put_asset), {}},
      {"GET", "/v1/assets/{sha256}", with_context(get_asset), {}},
  };
  for (const tracer::Format format : tracer::all_formats) {
    const std::string name = "image." + std::string(tracer::extension(format));
    routes.push_back({"GET", "/v1/jobs/{id}/" + name, image(name), {}});
  }
  for (const char* const name : {"measure.json", "measure.csv", "measure.svg", "measure.png"}) {
    routes.push_back({"GET", std::string("/v1/jobs/{id}/") + name, image(name), {}});
  }
  for (Route& route : routes) route.handler = with_access(route.handler, context->keys);
  return routes;
}

std::vector<Route> health_routes(const Health& health) {
  const auto readiness = std::make_shared<Readiness>(health);
  return {
      {"GET", "/healthz", get_liveness, {}},
      {"GET", "/readyz", [readiness](Request&) { return get_readiness(*readiness); }, {}},
      {"GET", "/metrics", [health](Request&) { return get_metrics(health); }, {}},
  };
}

}  // namespace http
