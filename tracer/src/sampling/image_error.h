#pragma once
/// From pixels to the error told of their image.

#include <cstdint>
#include <span>
#include <vector>

#include "tracer/render.h"
#include "tracer/src/integrators/whitted/wavefront.h"
#include "tracer/src/sampling/error_estimate.h"
#include "tracer/src/sampling/uniform_error.h"

namespace tracer {

/// The brightest channel of the image, where something asks for it: `overflow: scale`, or a scene without a bound of
/// its radiance. 0 elsewhere.
double brightest_if_needed(const CompiledScene& scene, std::span<const float> rgb);

/// What a unit of weight that was not traced can hide: the scene's bound of radiance, or without one that of the
/// brightest pixel.
struct RadianceBound {
  double radiance = 0;
  bool bounded = true;
};
RadianceBound hideable(const CompiledScene& scene, double brightest_pixel);

/// What pixels are judged by.
struct ErrorContext {
  DisplayTransform levels;
  RadianceBound hideable;
};

/// Adds what a pixel lacks; `rgb` is its mean.
void add(MissingError& sums, const float* rgb, const OmittedRadiance& omitted, const ErrorContext& judging);

/// One pixel's in the layer `error`, from the variance of its mean and what it lacks.
float pixel_error(double variance, const float* rgb, const OmittedRadiance& omitted, const ErrorContext& judging);

/// A pixel that lacks something; most of most images lack nothing.
struct OmittedSample {
  std::uint32_t place;      ///< images end at 2^26 pixels
  OmittedRadiance omitted;  ///< the mean of its samples'
};

/// What is known of an image of equal samples; the same for any number of threads. Also writes the layer `error` where
/// `image` has one. `pixels` are those of `image`; `lacks`: by tile, no pixel twice.
struct UniformAccount {
  SampledError sampled;
  MissingError omitted;
};
UniformAccount account_for(Image& image, const UniformPixels& pixels, std::span<const std::vector<OmittedSample>> lacks,
                           const ErrorContext& judging, const InParallel& in_parallel);

}  // namespace tracer
