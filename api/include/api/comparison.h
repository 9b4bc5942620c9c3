#pragma once
/// Writes the comparison of two images as JSON.

#include <array>
#include <optional>
#include <string>

#include "tracer/compare.h"

namespace api {

/// What is known of a comparison beside its figures.
struct ComparedAs {
  std::array<std::string, 2> formats;  ///< of the files: "PNG", "OpenEXR"
  std::optional<double> tolerance;     ///< levels of root mean square error
  std::optional<double> heat_white;    ///< levels; where a heat map was drawn
};

/// {formats[2], width, height, rmse, rmse_channel[3], bias, greatest, psnr_db, ssim, differing, worst[{x, y,
/// difference, a[3], b[3]}], tolerance, within_tolerance, heat_white}: tracer::Comparison by its names and in its
/// units, and whether `rmse` is at most the tolerance. Null: `psnr_db` of equal images, `ssim` of small ones, and
/// what was not asked for.
std::string write_comparison(const tracer::Comparison& comparison, const ComparedAs& how);

}  // namespace api
