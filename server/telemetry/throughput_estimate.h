#pragma once
/// How fast this machine renders of late, for estimates of what is to come.

#include <deque>
#include <mutex>
#include <optional>
#include <string>

#include "api/report.h"

namespace telemetry {

/// Thread-safe.
class ThroughputEstimate {
 public:
  /// Of a job that succeeded; what is no report of a render is left out.
  void learn(const std::string& report);
  void learn(const api::ReportFigures& figures);
  /// For api::estimated_work: the median of the latest renders, so that one in a hundred that is quite otherwise counts
  /// for little. Nothing before the first.
  [[nodiscard]] std::optional<double> seconds_per_work() const;

  static constexpr std::size_t renders_max = 63;  ///< that many are looked at: of late, and enough to have a middle

 private:
  mutable std::mutex mutex_;
  std::deque<double> seconds_per_work_;  ///< oldest first
};

}  // namespace telemetry
