#pragma once
/// Looks: fresh pairs of halves of randomly drawn pixels, which validate an image.
///
/// A look at a pixel with the value X takes two independent halves R1 and R2 of samples that are in no pixel. The
/// product (X - R1)(X - R2) is an unbiased estimate of the pixel's squared error. Pixels are drawn in proportion to the
/// bounds of their squared errors, known before any look. Each error is divided by its pixel's probability (Hansen &
/// Hurwitz 1943, "On the theory of sampling from finite populations").

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/sampling/error_estimate.h"
#include "tracer/src/sampling/pixel_sums.h"

namespace tracer {

struct Look {
  std::uint32_t place = 0;  ///< images have at most 2^26 pixels
  std::uint32_t index = 0;  ///< number of earlier looks at the pixel: each look has samples of its own
  double weight = 0;        ///< 1 / probability of the pixel in one draw
};

/// Samples in each half of a look. With fewer, the mean code value of a half would be darker than that of the mean.
/// Looks that measure approximations may take more, for paths by diffuse surfaces have more noise.
inline constexpr std::uint32_t look_half = 8, look_half_max = 4096;

/// The least number of looks that validates an image with open pixels.
inline constexpr std::size_t looks_min = 1024;

/// The number of looks that measure the light of patches by paths: fewer for an image of few pixels.
inline constexpr std::size_t path_looks_min = 64;
inline std::size_t path_looks(std::size_t pixels) { return std::clamp<std::size_t>(pixels, path_looks_min, 512); }

/// Draws from all pixels by `bounds` of their squared errors alone, after `first` earlier draws; ascending by place.
/// All of them are stratified over the sum: the draws depend on each other, and estimates from them vary less.
std::vector<Look> draw_looks(std::span<const float> bounds, std::size_t count, std::size_t first, std::uint64_t seed);

/// Error that fewer looks than `enough` cannot exclude, if those show `found` where at most `bounds` is possible: by
/// Laplace's rule of succession, as if each find were as large as it can be.
double unseen_error(std::size_t looks, double bounds, double found, std::size_t enough = looks_min);

/// Mean of the squared errors of looks, each divided by the probability of its pixel: the error of all pixels with
/// bounds that add up to `bounds`. Fewer looks than `looks_min` without a find add what they cannot exclude.
SampledError error_of_looks(std::span<const double> errors, double bounds);

/// Mean of the squared errors by ended rays that looks have found. The upper bound is at most `bound`, and 3 / n of it
/// if all n are 0 (rule of three: Hanley & Lippman-Hand 1983, "If nothing goes wrong, is everything all right?").
SampledError truncation_error(std::span<const double> squares, double bound);

/// Product of what two samples add to the displayed pixel, summed over the channels.
double squared_change(const Color& value, const Halves& added, const DisplayTransform& display);

}  // namespace tracer
