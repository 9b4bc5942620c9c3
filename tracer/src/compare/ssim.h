#pragma once
/// Structural similarity of two images; see Comparison::ssim.

#include <optional>

#include "tracer/compare.h"

namespace tracer {

/// Allocates memory for a few rows only. Precondition: equal sizes.
std::optional<double> structural_similarity(const DisplayImage& a, const DisplayImage& b);

}  // namespace tracer
