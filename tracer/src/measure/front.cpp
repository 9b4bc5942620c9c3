#include <algorithm>
#include <limits>
#include <numeric>

#include "tracer/measurement.h"

namespace tracer {

std::vector<std::size_t> pareto_front(std::span<const MeasuredPoint> points) {
  std::vector<std::size_t> by_time(points.size());
  std::iota(by_time.begin(), by_time.end(), std::size_t{0});
  std::stable_sort(by_time.begin(), by_time.end(), [&](std::size_t one, std::size_t other) {
    const MeasuredPoint &a = points[one], &b = points[other];
    return a.seconds != b.seconds ? a.seconds < b.seconds : a.error < b.error;
  });
  std::vector<std::size_t> front;
  double least_error = std::numeric_limits<double>::infinity();
  for (const std::size_t index : by_time) {
    if (points[index].error >= least_error) continue;
    least_error = points[index].error;
    front.push_back(index);
  }
  return front;
}

}  // namespace tracer
