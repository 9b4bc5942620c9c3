#include "server/telemetry/request_metrics.h"

#include <new>

#include "server/telemetry/job_metrics.h"

namespace telemetry {
namespace {

constexpr std::string_view requests = "whittle_requests_total", request_seconds = "whittle_request_seconds";

}  // namespace

void count_request(Metrics& metrics, std::string_view method, std::string_view route, int status,
                   double seconds) noexcept {
  try {
    metrics.add(requests,
                {{"method", std::string(method)}, {"route", std::string(route)}, {"status", std::to_string(status)}});
    metrics.observe(request_seconds, {{"route", std::string(route)}}, seconds);
  } catch (const std::bad_alloc&) {
    // A figure is the least of what is missed then.
  }
}

std::vector<Family> all_families() {
  std::vector<Family> families = JobMetrics::families();
  families.push_back({requests, "Requests of clients, by route and status; without a route: refused, or not found."});
  families.push_back({request_seconds,
                      "From a whole request to the beginning of its reply, waiting included, by route.",
                      waiting_seconds()});
  return families;
}

}  // namespace telemetry
