#pragma once
/// Every route of the service (HTTP.md), as values for a Gate. api/openapi.yaml describes the same; a test holds both
/// together.

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/batch.h"
#include "api/document.h"
#include "server/http/exchange.h"
#include "server/jobs/clock.h"
#include "server/jobs/job_service.h"

namespace http {

/// What the client routes need. The functions and the service are thread-safe and outlive the gate.
struct Front {
  jobs::JobService& jobs;
  jobs::Clock clock;
  api::Limits limits;
  api::BatchLimits batch_limits;  ///< their `document` is `limits`
  /// An issue for each file that the scene names and that is not there to be read. Unset: `limits` let none be named.
  std::function<std::vector<tracer::Issue>(const tracer::Scene&)> missing_files;
  std::function<std::string(std::string_view)> sha256;  ///< of bytes, as 64 hex digits
  std::uint64_t job_memory_bytes = 16ull << 30;         ///< scenes that are estimated to take more are refused
  std::chrono::milliseconds render_wait{60'000};        ///< see the option render_wait_s
  std::function<bool()> draining;                       ///< true: new work is refused, reads are answered
  std::vector<std::pair<std::string, std::uint64_t>> told_limits;  ///< what GET /v1/version tells, by option name
};
std::vector<Route> client_routes(const Front& front);

/// What the health routes need; the same rules.
struct Health {
  std::function<std::string()> not_ready;                 ///< empty: ready; else the reason
  std::function<std::int64_t(jobs::JobState)> job_count;  ///< may throw StoreFailure
};
std::vector<Route> health_routes(const Health& health);

}  // namespace http
