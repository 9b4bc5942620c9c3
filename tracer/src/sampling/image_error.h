#pragma once
/// Error of an image from its pixels, without further rays: local contrast, sampling and omitted radiance.

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "tracer/render.h"
#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/display/display_transform.h"
#include "tracer/src/integrators/radiance_bound.h"
#include "tracer/src/integrators/tracer.h"
#include "tracer/src/math/lanes.h"
#include "tracer/src/sampling/error_estimate.h"
#include "tracer/src/sampling/subpixel_features.h"

namespace tracer {

/// 8-bit code values of a row of pixels, one plane per channel.
using CodeValueRow = std::array<std::vector<float>, 3>;

/// Local contrast of an image, where it is not smooth. The contrast of a pixel: its largest squared second difference
/// over the four directions through it, summed over the channels. Linear gradients have none, whatever their slope: the
/// center of the pixel is then its mean. An edge has its full height on both sides. At the border: the contrast of the
/// nearest three pixels in a row.
///
/// If rows are requested in ascending order, the code values of each row are computed once and three rows are kept. One
/// thread.
class ContrastRows {
 public:
  /// `write_row` writes the code values of row y.
  ContrastRows(std::size_t columns, std::size_t rows, std::function<void(std::size_t y, CodeValueRow&)> write_row);

  /// Contrasts of row y; valid until the next call.
  std::span<const float> row(std::size_t y);

 private:
  const CodeValueRow& code_values(std::size_t y);

  std::size_t columns_, rows_;
  std::function<void(std::size_t, CodeValueRow&)> write_row_;
  std::array<CodeValueRow, 3> kept_;
  std::array<std::size_t, 3> kept_row_;
  std::vector<float> contrast_;
};

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
  const Output& output;  ///< must outlive it
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

/// Subpixel features that the samples of their pixel have missed.
struct MissedFeature {
  std::uint32_t place = 0;
  float squared = 0;    ///< error, in squared code values, summed over the channels and the pixels it stands for
  float brightest = 0;  ///< channel of the pixel with the features
};

/// References must outlive it.
struct UniformPixels {
  std::span<const float> rgb;        ///< means, three channels per pixel
  std::span<const float> deviation;  ///< standard deviation of each mean, three channels; empty for one sample
  std::uint32_t width = 0;
  std::uint32_t samples = 1;                ///< per pixel
  std::span<const MissedFeature> missed{};  ///< ascending by place
  bool indirect = false;                    ///< reflection or refraction may show features that nobody searched
  bool noisy = false;                       ///< chance is in every pixel: light may be rare and bright

  [[nodiscard]] std::size_t rows() const { return width > 0 ? rgb.size() / 3 / width : 0; }
};

/// Features that the samples of their pixels have missed, those of a pixel together, ascending by place. `radiance` is
/// parallel to `features`; features without finite radiance are left out. A feature was hit if the halves of the
/// pixel's samples differ by half of what one hit changes; where four hits are expected it was not missed.
std::vector<MissedFeature> missed_features(std::span<const SubpixelFeature> features, std::span<const Color> radiance,
                                           const UniformPixels& pixels, const PixelWindow& window,
                                           const DisplayTransform& display);

/// The pixels of a window that have a feature in them or next to them, row by row; empty: there are none.
struct PixelFeatures {
  /// Squared error if the one sample that is in the pixel's mean has missed the feature, in squared code values, summed
  /// over the channels; -1 for pixels without a feature.
  std::vector<float> squared{};
  std::vector<float> brightest{};  ///< channel of the pixel with the feature; infinite if it is not known
};
PixelFeatures features_of_pixels(std::span<const SubpixelFeature> features, std::span<const Color> radiance,
                                 const UniformPixels& pixels, const PixelWindow& window,
                                 const DisplayTransform& display);

/// Variance of every pixel's mean, in squared code values, summed over the channels; row by row, best in ascending
/// order. One thread.
///
/// From the deviations, which halves of the samples estimate: jointly stratified halves differ more than independent
/// ones, so it is too large by up to 2^p - 1, where p is `variance_power`. Of a single sample, the prediction from the
/// contrast. Errors of missed features are added.
class UniformVariance {
 public:
  /// `display` must outlive it.
  UniformVariance(const UniformPixels& pixels, const DisplayTransform& display);
  UniformVariance(const UniformVariance&) = delete;
  UniformVariance& operator=(const UniformVariance&) = delete;

  /// Variances of row y; valid until the next call.
  std::span<const float> row(std::size_t y);

 private:
  [[nodiscard]] float variance_of(std::size_t pixel) const;

  UniformPixels pixels_;
  const DisplayTransform& display_;
  ContrastRows contrasts_;
  std::vector<float> variance_;
};

/// Measures the error of an image with equally many samples per pixel; deterministic for any number of threads. Also
/// writes the layer `error` if `image` has one. `omitted`: by tile, each pixel at most once.
ErrorEstimate measure_uniform_errors(Image& image, const UniformPixels& pixels,
                                     std::span<const std::vector<OmittedSample>> omitted, const ErrorContext& context,
                                     const InParallel& in_parallel);

}  // namespace tracer
