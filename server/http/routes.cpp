#include "server/http/routes.h"

#include "server/http/handlers.h"
#include "tracer/encode.h"

namespace http {

std::vector<Route> client_routes(const Front& front) {
  const auto with_front = [&](Answer (*handler)(Request&, const Front&)) -> Handler {
    return [front, handler](Request& request) { return handler(request, front); };
  };
  const auto picture = [&](const std::string& name) -> Handler {
    return [front, name](Request& request) { return get_picture(request, front, name); };
  };
  std::vector<Route> routes{
      {"GET", "/", get_root, {}},
      {"GET", "/openapi.json", get_openapi, {}},
      {"GET", "/v1/version", with_front(get_version), {}},
      {"POST", "/v1/jobs", with_front(submit_job), {}},
      {"GET", "/v1/jobs", with_front(list_jobs), {"state", "label", "q", "limit", "cursor"}},
      {"POST", "/v1/jobs/validate", with_front(validate_job), {}},
      {"POST", "/v1/render", with_front(render), {}},
      {"GET", "/v1/jobs/{id}", with_front(get_job), {}},
      {"DELETE", "/v1/jobs/{id}", with_front(remove_job), {}},
      {"POST", "/v1/jobs/{id}/cancel", with_front(cancel_job), {}},
      {"GET", "/v1/jobs/{id}/deliveries", with_front(get_deliveries), {}},
      {"POST", "/v1/assets/missing", with_front(find_missing_assets), {}},
      {"PUT", "/v1/assets/{sha256}", with_front(put_asset), {}},
      {"GET", "/v1/assets/{sha256}", with_front(get_asset), {}},
  };
  for (const tracer::Format format : tracer::all_formats) {
    const std::string name = "image." + std::string(tracer::extension(format));
    routes.push_back({"GET", "/v1/jobs/{id}/" + name, picture(name), {}});
  }
  return routes;
}

std::vector<Route> health_routes(const Health& health) {
  return {
      {"GET", "/healthz", get_liveness, {}},
      {"GET", "/readyz", [health](Request& request) { return get_readiness(request, health); }, {}},
      {"GET", "/metrics", [health](Request& request) { return get_metrics(request, health); }, {}},
  };
}

}  // namespace http
