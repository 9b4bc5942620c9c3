#pragma once
/// The similarity of structure of two pictures; see Comparison::ssim.

#include <optional>

#include "tracer/compare.h"

namespace tracer {

/// Needs memory for a few rows, not for the picture. Precondition: equal sizes.
std::optional<double> structural_similarity(const ShownPicture& a, const ShownPicture& b);

}  // namespace tracer
