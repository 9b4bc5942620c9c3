#pragma once
/// Decides whether the measured times of settings are certain enough to rank the settings.

#include <cstddef>
#include <span>
#include <vector>

#include "tracer/measurement.h"

namespace tracer {

/// Relation of the expected times of two settings: different, equal for any purpose, or not known yet.
enum class TimeOrder { different, equal, uncertain };

/// Compares the runs of two settings, of which the runs with equal indices were measured in the same round: the load of
/// the machine, which changes from round to round, affects both. The 95 % interval of their mean relative difference
/// (Student 1908, "The probable error of a mean", Biometrika 6) decides: different if it excludes 0, equal if it
/// contains only differences below 5 %. A disturbed run widens the interval, so it makes no order certain. Uncertain
/// with fewer than two pairs, and if the fastest runs are in the other order than the mean.
TimeOrder compare_times(std::span<const double> one, std::span<const double> other);

/// Returns true for an approximation that is not faster for certain than the exact render of the same accuracy
/// otherwise. False if that was not measured.
bool saves_no_time(std::span<const MeasuredPoint> points, const MeasuredPoint& approximation);

/// Indices of the points, ascending, that are to be timed again: those with a single run, which includes the costs of a
/// first one, and those whose order relative to a neighbor in time, or to the exact render, is uncertain.
std::vector<std::size_t> unranked_points(std::span<const MeasuredPoint> points);

}  // namespace tracer
