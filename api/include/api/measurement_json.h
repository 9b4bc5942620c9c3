#pragma once
/// Writes what accuracy costs in a scene as JSON and CSV, and reads the JSON again, to go on from it.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tracer/measurement.h"

namespace api {

/// What is known of a measurement beside its figures.
struct MeasuredAs {
  std::string key;        ///< tells measurements of other scenes, sizes or builds apart
  bool complete = false;  ///< all settings have been measured
};

/// {kind: "whittle measurement", version: 1, build, key, complete, scene, width, height, reference{samples, error},
/// points[{parameter, value, preset, settings, seconds, error, claimed{...}, samples{mean, total}, rays{...}}],
/// pareto_front[index], advice[sentence]}: tracer::Measurement by its names and in its units. `settings` is the
/// "accuracy" of a document that renders the same; `preset` is null where it has no name; `pareto_front` counts the
/// points from 0, fastest first.
std::string write_measurement(const tracer::Measurement& measurement, const MeasuredAs& how);

/// Comma-separated, a line for each point below one of names; `pareto_front` is 1 where no point is better. Lines end
/// in \n, no value holds a comma or a quote.
std::string write_measurement_csv(const tracer::Measurement& measurement);

/// What a job document tells of it, some kilobytes: {width, height, alone, reference{samples, error},
/// points[{parameter, value, preset, settings, seconds, error, claimed}], pareto_front[index], advice[sentence]} as
/// write_measurement has them; `claimed` is the estimate alone. `alone`: nothing else was rendered meanwhile by the
/// same process, so that seconds are those of a machine at hand.
std::string write_measurement_summary(const tracer::Measurement& measurement, bool alone);

struct SavedMeasurement {
  MeasuredAs how;
  std::vector<tracer::MeasuredPoint> points;  ///< of their settings only parameter and value
};

/// Nothing where `text` is none that write_measurement of this version wrote. Throws std::bad_alloc only.
std::optional<SavedMeasurement> read_measurement(std::string_view text);

}  // namespace api
