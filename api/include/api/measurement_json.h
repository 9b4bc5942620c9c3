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

/// {kind: "whittle measurement", version: 2, build, key, complete, scene, width, height, reference{samples, error},
/// points[{parameter, value, preset, settings, seconds, runs[seconds], error, broken, model, model_error, total_error,
/// claimed{...}, samples{mean, total}, rays{...}}], pareto_front[index], model_error{levels, standard_error, bias,
/// by{interreflection[3], emission[3], environment[3], ambient[3]}, fitted_ambient[3], fitted_levels,
/// fronts{MODEL[index]}}, advice[sentence]}, with the names and units of tracer::Measurement. `settings` is the
/// "accuracy" section of a document with the same result (and with `fitted_ambient` as `ambient` for that model);
/// `preset`, `model` and its errors are null if the setting has none; `broken` is that of tracer::is_broken; the fronts
/// have indices of points, fastest first. The measurement's `model_error` is null without the parameter "model", and
/// {not_measured} if the rendering equation refuses the scene.
std::string write_measurement(const tracer::Measurement& measurement, const MeasurementInfo& info);

/// Comma-separated: a line of column names, then a line per point. `pareto_front` is 1 if no point is better (of the
/// same model and by total error, with the parameter "model"), `broken` if the claim is broken; `proven` is empty if
/// nothing is proven; `runs` is their number. Lines end in \n, and no value contains a comma or a quote.
std::string write_measurement_csv(const tracer::Measurement& measurement);

/// The part that a job document contains, some kilobytes: {width, height, alone, reference{samples, error},
/// points[{parameter, value, preset, settings, seconds, error, broken, model, model_error, total_error, claimed}],
/// pareto_front[index], model_error, advice[sentence]} as in write_measurement; `claimed` is the estimate alone.
/// `alone`: no other job was rendered by the same process at the same time, so `seconds` are those of an otherwise idle
/// machine.
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

/// {formats[2], width, height, rmse, rmse_channel[3], bias, greatest, psnr_db, ssim, differing, worst[{x, y,
/// difference, a[3], b[3]}], tolerance, within_tolerance, heat_white}, with the names and units of tracer::Comparison.
/// within_tolerance is true if `rmse` is at most the tolerance. Null: `psnr_db` of equal images, `ssim` of small ones,
/// and unset options.
std::string write_comparison(const tracer::Comparison& comparison, const ComparisonInfo& info);

/// Adds `heat_map`, the URL of its PNG or null, to a comparison of write_comparison. Unset if the text is no JSON
/// object. Throws std::bad_alloc only.
std::optional<std::string> add_heat_map(std::string_view comparison, const std::optional<std::string>& url);

}  // namespace api
