#include "tracer/src/measure/time_ranking.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace tracer {
namespace {

constexpr double equal_share = 0.05;  // smaller differences vary from day to day

/// Two-sided 95 % quantiles of Student's t distribution with 1, 2, ... degrees of freedom.
constexpr std::array t_quantiles{12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228};

/// Difference relative to the mean of both, in [-2, 2].
double relative_difference(double one, double other) {
  const double sum = one + other;
  return sum > 0 ? 2 * (one - other) / sum : 0;
}

/// The render that an approximation replaces; null for other points, and if it was not measured.
const MeasuredPoint* exact_render(std::span<const MeasuredPoint> points, const MeasuredPoint& approximation) {
  if (!approximation.setting.accuracy.approximate.any()) return nullptr;
  Accuracy exact = approximation.setting.accuracy;
  exact.approximate = {};
  const auto found =
      std::ranges::find(points, exact, [](const MeasuredPoint& point) { return point.setting.accuracy; });
  return found == points.end() ? nullptr : &*found;
}

}  // namespace

TimeOrder compare_times(std::span<const double> one, std::span<const double> other) {
  const std::size_t count = std::min(one.size(), other.size());
  if (count < 2) return TimeOrder::uncertain;
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < count; ++i) sum += relative_difference(one[i], other[i]);
  const double pairs = static_cast<double>(count), mean = sum / pairs;
  for (std::size_t i = 0; i < count; ++i) squares += std::pow(relative_difference(one[i], other[i]) - mean, 2);
  const double quantile = t_quantiles[std::min(count - 1, t_quantiles.size()) - 1];
  const double half_width = quantile * std::sqrt(squares / (pairs - 1) / pairs);
  const bool fastest_agree = (mean < 0) == (std::ranges::min(one) < std::ranges::min(other));
  if (std::abs(mean) > half_width && fastest_agree) return TimeOrder::different;
  return std::abs(mean) + half_width <= equal_share ? TimeOrder::equal : TimeOrder::uncertain;
}

bool saves_no_time(std::span<const MeasuredPoint> points, const MeasuredPoint& approximation) {
  const MeasuredPoint* const exact = exact_render(points, approximation);
  return exact != nullptr && (approximation.seconds >= exact->seconds ||
                              compare_times(approximation.runs, exact->runs) != TimeOrder::different);
}

std::vector<std::size_t> unranked_points(std::span<const MeasuredPoint> points) {
  std::vector<std::size_t> by_time(points.size());
  std::iota(by_time.begin(), by_time.end(), std::size_t{0});
  std::ranges::stable_sort(by_time, {}, [&](std::size_t i) { return points[i].seconds; });
  std::vector<bool> unranked(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) unranked[i] = points[i].runs.size() < 2;
  for (std::size_t i = 1; i < by_time.size(); ++i) {
    const std::size_t one = by_time[i - 1], other = by_time[i];
    if (compare_times(points[one].runs, points[other].runs) != TimeOrder::uncertain) continue;
    unranked[one] = unranked[other] = true;
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const MeasuredPoint* const exact = exact_render(points, points[i]);
    if (exact == nullptr || compare_times(points[i].runs, exact->runs) != TimeOrder::uncertain) continue;
    unranked[i] = unranked[static_cast<std::size_t>(exact - points.data())] = true;
  }
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < unranked.size(); ++i)
    if (unranked[i]) indices.push_back(i);
  return indices;
}

}  // namespace tracer
