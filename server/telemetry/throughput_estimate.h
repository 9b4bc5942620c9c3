#pragma once
/// Recent render speed of this machine, for time estimates.

#include <deque>
#include <mutex>
#include <optional>
#include <string>

#include "api/report.h"

namespace telemetry {

/// Thread-safe.
class ThroughputEstimate {
 public:
  /// Adds a succeeded render. Other reports are ignored.
  void add(const std::string& report);
  void add(const api::ReportFigures& figures);
  /// Median over the latest renders, per unit of api::estimated_work; nothing before the first one.
  [[nodiscard]] std::optional<double> seconds_per_work() const;

  static constexpr std::size_t renders_max = 63;  ///< recent enough to follow a change, enough for a stable median

 private:
  mutable std::mutex mutex_;
  std::deque<double> seconds_per_work_;  ///< oldest first
};

}  // namespace telemetry
