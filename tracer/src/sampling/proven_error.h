#pragma once
/// Proven bounds of the error of refined pixels.

#include <span>

#include "tracer/src/sampling/pixel_state.h"

namespace tracer {

/// Upper bound of the sum of squared errors of the refined pixels, in squared code values over the channels, with
/// probability 1 - `alpha`. Assumes that the numbers of samples are given, that the halves are independent, and that
/// their mean code values are those of the mean.
///
/// The squared differences of the halves, (F1 - F2)^2 / 4, are independent, lie within a quarter of the pixel's bound
/// and have the pixel's variance as their mean: a confidence sequence bounds the sum of the variances. The squared
/// errors are independent as well, lie within the bound B and have the same mean, so that their sum S exceeds its mean
/// E by the factor 1 + d with a probability of at most exp(-E / B ((1 + d) log(1 + d) - d)) (Hoeffding 1963,
/// "Probability inequalities for sums of bounded random variables", JASA 58; Chernoff 1952). Each step takes half of
/// `alpha`.
double proven_refined_error(std::span<const PixelState> pixels, const DisplayTransform& display, double alpha);

/// The smallest x >= `mean` that a sum of independent variables within [0, `largest`] with the mean `mean` exceeds with
/// a probability of at most `alpha`.
double sum_bound(double mean, double largest, double alpha);

}  // namespace tracer
