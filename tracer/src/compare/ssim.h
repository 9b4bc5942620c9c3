#pragma once
/// The similarity of structure of two images; see Comparison::ssim.

#include <optional>

#include "tracer/compare.h"

namespace tracer {

/// Needs memory for a few rows, not for the image. Precondition: equal sizes.
std::optional<double> structural_similarity(const DisplayImage& a, const DisplayImage& b);

}  // namespace tracer
