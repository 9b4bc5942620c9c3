#include "server/http/handlers/routes.h"

#include "server/http/access.h"
#include "server/http/handlers/handlers.h"
#include "tracer/encode.h"

namespace http {

std::vector<Route> client_routes(const ApiContext& front) {
  const auto with_front = [&](Answer (*handler)(Request&, const ApiContext&)) -> Handler {
    return [front, handler](Request& request) { return handler(request, front); };
  };
  const auto image = [&](const std::string& name) -> Handler {
    return [front, name](Request& request) { return get_image(request, front, name); };
  };
  std::vector<Route> routes{
      {"GET", "/", get_root, {}},
      {"GET", "/openapi.json", get_openapi, {}},
      {"GET", "/docs", get_docs, {}},
      {"GET", "/v1/version", with_front(get_version), {}},
      {"POST", "/v1/jobs", with_front(submit_job), {}},
      {"GET", "/v1/jobs", with_front(list_jobs), {"state", "label", "batch", "q", "limit", "cursor"}},
      {"POST", "/v1/jobs/validate", with_front(validate_job), {}},
      {"POST", "/v1/render", with_front(render), {}},
      {"POST", "/v1/measure", with_front(measure), {}},
      {"GET", "/v1/jobs/{id}", with_front(get_job), {"wait"}},
      {"PATCH", "/v1/jobs/{id}", with_front(change_job), {}},
      {"DELETE", "/v1/jobs/{id}", with_front(remove_job), {}},
      {"POST", "/v1/jobs/{id}/cancel", with_front(cancel_job), {}},
      {"POST", "/v1/jobs/{id}/retry", with_front(retry_job), {}},
      {"GET", "/v1/jobs/{id}/preview", with_front(get_preview), {"max"}},
      {"GET", "/v1/jobs/{id}/events", with_front(get_job_events), {}},
      {"GET", "/v1/events", with_front(get_events), {}},
      {"POST", "/v1/batches", with_front(submit_batch), {}},
      {"GET", "/v1/batches/{id}", with_front(get_batch), {}},
      {"POST", "/v1/batches/{id}/cancel", with_front(cancel_batch), {}},
      {"POST", "/v1/batches/{id}/retry", with_front(retry_batch), {}},
      {"GET", "/v1/batches/{id}/artifacts.tar", with_front(get_batch_artifacts), {}},
      {"GET", "/v1/queue", with_front(get_queue), {}},
      {"GET", "/v1/jobs/{id}/deliveries", with_front(get_deliveries), {}},
      {"POST", "/v1/assets/missing", with_front(find_missing_assets), {}},
      {"PUT", "/v1/assets/{sha256}", with_front(put_asset), {}},
      {"GET", "/v1/assets/{sha256}", with_front(get_asset), {}},
  };
  for (const tracer::Format format : tracer::all_formats) {
    const std::string name = "image." + std::string(tracer::extension(format));
    routes.push_back({"GET", "/v1/jobs/{id}/" + name, image(name), {}});
  }
  for (const char* const name : {"measure.json", "measure.csv", "measure.svg", "measure.png"}) {
    routes.push_back({"GET", std::string("/v1/jobs/{id}/") + name, image(name), {}});
  }
  for (Route& route : routes) route.handler = with_access(route.handler, front.keys);
  return routes;
}

std::vector<Route> health_routes(const Health& health) {
  const auto readiness = std::make_shared<Readiness>(health);
  return {
      {"GET", "/healthz", get_liveness, {}},
      {"GET", "/readyz", [readiness](Request& request) { return get_readiness(request, *readiness); }, {}},
      {"GET", "/metrics", [health](Request& request) { return get_metrics(request, health); }, {}},
  };
}

}  // namespace http
