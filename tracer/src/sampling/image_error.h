#pragma once
/// Error of an image from its pixels, without further rays: sampling and omitted radiance.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "tracer/render.h"
#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/display/display_transform.h"
#include "tracer/src/integrators/tracer_concept.h"
#include "tracer/src/sampling/contrast.h"
#include "tracer/src/sampling/error_estimate.h"

namespace tracer {

/// Upper bound of the radiance along any ray of a scene, and so of the radiance along an omitted ray.
///
/// The least L with L >= L_background and L >= E_m + rho_m L for every material m, in every channel, where E_m bounds
/// the local shading and rho_m the albedo for secondary rays: L = max(L_background, max_m E_m / (1 - rho_m)). None if
/// there is no solution: a light with unbounded attenuation, or an emissive material with albedo 1.
std::optional<double> radiance_bound(const CompiledScene& scene);

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

/// References must outlive it.
struct UniformPixels {
  std::span<const float> rgb;       ///< means, three channels per pixel
  std::span<const float> variance;  ///< variances of each pixel's samples, three channels; empty for one sample
  std::uint32_t samples = 1, width = 0;

  [[nodiscard]] std::size_t rows() const { return width > 0 ? rgb.size() / 3 / width : 0; }
};

/// Variance of every pixel's mean, in squared code values, summed over the channels; row by row, best in ascending
/// order. One thread.
///
/// The variance of the samples divided by their number is that of independent samples; stratified ones have less (Owen
/// 1997). The prediction from the contrast is added with the weight of two samples, so that samples that agree by
/// chance, because all missed an edge, do not count as exact.
class UniformVariance {
 public:
  /// `display` must outlive it.
  UniformVariance(const UniformPixels& pixels, const DisplayTransform& display);
  UniformVariance(const UniformVariance&) = delete;
  UniformVariance& operator=(const UniformVariance&) = delete;

  /// Variances of row y; valid until the next call.
  std::span<const float> row(std::size_t y);

 private:
  [[nodiscard]] double sample_variance(std::size_t pixel) const;

  UniformPixels pixels_;
  const DisplayTransform& display_;
  ContrastRows contrasts_;
  std::vector<float> variance_;
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
