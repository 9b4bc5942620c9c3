#pragma once
/// The error of a picture that has the same number of samples in every pixel, from these samples alone: no ray is
/// traced for it. It errs on the side of claiming too much.

#include <cstdint>
#include <span>
#include <vector>

#include "tracer/src/accuracy/account.h"

namespace tracer {

/// Variance of every pixel's mean, in squared levels, the channels added up. `rgb`: the means, three a pixel; `spread`:
/// the variance of each pixel's samples, likewise, empty where there is one sample.
///
/// The samples' variance over their number is that of independent ones; stratified ones have less (Owen 1997). It is
/// joined, with the weight of two samples, by what the contrast to the neighbours lets expect: samples that agree by
/// chance, an edge having been missed, then do not count as exact.
std::vector<float> uniform_variance(std::span<const float> rgb, std::span<const float> spread, std::uint32_t samples,
                                    std::uint32_t width, const Levels& levels);

}  // namespace tracer
