#pragma once
/// Writes a measurement of a scene (tracer/measurement.h) as JSON and CSV, and reads the JSON to resume it; writes the
/// comparison of two images (tracer/compare.h) as JSON.

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tracer/compare.h"
#include "tracer/measurement.h"

namespace api {

/// Circumstances of a measurement.
struct MeasurementInfo {
  std::string key;        ///< differs between scenes, sizes and builds
  bool complete = false;  ///< all settings have been measured
};

/// The schema Measurement of api/openapi.yaml without `alone`, and kind, version, build, key, complete and scene. Its
/// points have all their `runs`, `samples{mean, total}` and `rays` too, and all of the estimate in `claimed`. The names
/// and units are those of tracer::Measurement. `settings` of the model "fitted ambient" are those of a document that
/// has `fitted_ambient` as `ambient`.
std::string write_measurement(const tracer::Measurement& measurement, const MeasurementInfo& info);

/// Comma-separated: a line of column names, then a line per point. `pareto_front` is 1 if no point is better (of the
/// same model and by total error, with the parameter "model"), `broken` if the claim is broken; `proven` is empty if
/// nothing is proven; `runs` is their number. Lines end in \n, and no value contains a comma or a quote.
std::string write_measurement_csv(const tracer::Measurement& measurement);

/// The part that a job document contains, some kilobytes: the schema Measurement. `alone`: no other job was rendered by
/// the same process at the same time, so `seconds` are those of an otherwise idle machine.
std::string write_measurement_summary(const tracer::Measurement& measurement, bool alone);

struct SavedMeasurement {
  MeasurementInfo info;
  std::vector<tracer::MeasuredPoint> points;  ///< their settings have only parameter and value
};

/// Unset if `text` was not written by write_measurement of this version. Throws std::bad_alloc only.
std::optional<SavedMeasurement> read_measurement(std::string_view text);

/// Circumstances of a comparison of two images.
struct ComparisonInfo {
  std::array<std::string, 2> formats;  ///< file formats: "PNG", "OpenEXR"
  std::optional<double> tolerance;     ///< levels of root mean square error
  std::optional<double> heat_white;    ///< levels; set if a heat map was drawn
};

/// The schema Comparison of api/openapi.yaml without `heat_map`, with the names and units of tracer::Comparison.
std::string write_comparison(const tracer::Comparison& comparison, const ComparisonInfo& info);

}  // namespace api
