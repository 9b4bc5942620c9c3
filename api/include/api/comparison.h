#pragma once
/// Writes the comparison of two images as JSON.

#include <array>
#include <optional>
#include <string>

#include "tracer/compare.h"

namespace api {

/// Circumstances of a comparison.
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

}  // namespace api
