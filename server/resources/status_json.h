#pragma once
/// JSON of the state of the service (schema Status of api/openapi.yaml), as resource_json.h.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/queue/queue.h"
#include "server/telemetry/service_metrics.h"

namespace resources {

struct ServiceStatus {
  std::string not_ready;  ///< empty: ready
  bool draining = false;
  std::string sandbox;
  telemetry::GaugeValues gauges;
  queue::QueueState queue;
  std::size_t streams_max = 0;
  std::vector<std::pair<std::string, std::uint64_t>> limits;
  telemetry::ServiceHistory::Hour hour;
};
std::string write_status(const ServiceStatus& status);

}  // namespace resources
