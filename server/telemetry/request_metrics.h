#pragma once
/// Requests as figures.

#include <string_view>
#include <vector>

#include "server/telemetry/metric_registry.h"

namespace telemetry {

/// `route` is a pattern, so that there are few; empty: refused before it had one, or not found.
void count_request(Metrics& metrics, std::string_view method, std::string_view route, int status,
                   double seconds) noexcept;

/// What the daemon counts: jobs and requests.
std::vector<Family> all_families();

}  // namespace telemetry
