#include "server/telemetry/throughput_estimate.h"

#include <algorithm>
#include <vector>

namespace telemetry {

void ThroughputEstimate::add(const std::string& report) {
  if (const auto figures = api::read_report(report)) add(*figures);
}

void ThroughputEstimate::add(const api::ReportFigures& figures) {
  if (!figures.seconds_per_work) return;
  const std::lock_guard lock(mutex_);
  seconds_per_work_.push_back(*figures.seconds_per_work);
  if (seconds_per_work_.size() > renders_max) seconds_per_work_.pop_front();
}

std::optional<double> ThroughputEstimate::seconds_per_work() const {
  std::vector<double> sorted;
  {
    const std::lock_guard lock(mutex_);
    sorted.assign(seconds_per_work_.begin(), seconds_per_work_.end());
  }
  if (sorted.empty()) return std::nullopt;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  return *middle;
}

}  // namespace telemetry
