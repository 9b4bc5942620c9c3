#pragma once
/// Error of an image from its pixels: sampling and omitted radiance.

#include <cstdint>
#include <span>
#include <vector>

#include "tracer/render.h"
#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/integrators/tracer_concept.h"
#include "tracer/src/sampling/error_estimate.h"
#include "tracer/src/sampling/uniform_error.h"

namespace tracer {

/// The brightest channel of the image if `overflow: scale` or a scene without a radiance bound needs it; else 0.
double brightest_if_needed(const CompiledScene& scene, std::span<const float> rgb);

/// Upper bound of the radiance along an omitted ray: the scene's bound or, without one, the brightest pixel.
struct RadianceBound {
  double radiance = 0;
  bool bounded = true;
};
RadianceBound bound_omitted_radiance(const CompiledScene& scene, double brightest_pixel);

/// Parameters of a pixel's error.
struct ErrorContext {
  DisplayTransform display;
  RadianceBound bound;
};

/// Adds the error of a pixel with mean `rgb` by its omitted radiance.
void add(OmittedError& sums, const float* rgb, const OmittedRadiance& omitted, const ErrorContext& context);

/// A pixel of the layer `error`, from the variance of its mean and its omitted radiance.
float pixel_error(double variance, const float* rgb, const OmittedRadiance& omitted, const ErrorContext& context);

/// A pixel that omits radiance; few pixels do.
struct OmittedSample {
  std::uint32_t place;      ///< images have at most 2^26 pixels
  OmittedRadiance omitted;  ///< mean over the pixel's samples
};

struct UniformErrors {
  SampledError sampled;
  OmittedError omitted;
};
/// Measures the error of an image with equally many samples per pixel; deterministic for any number of threads. Also
/// writes the layer `error` if `image` has one. `omitted`: by tile, each pixel at most once.
UniformErrors measure_uniform_errors(Image& image, const UniformPixels& pixels,
                                     std::span<const std::vector<OmittedSample>> omitted, const ErrorContext& context,
                                     const InParallel& in_parallel);

}  // namespace tracer
