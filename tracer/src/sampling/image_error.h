#pragma once
/// Error of an image from its pixels, without further rays: local contrast, sampling, and the most that ended rays may
/// have.

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
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

/// Parameters of a pixel's error.
struct ErrorContext {
  DisplayTransform display;
  RadianceBound bound;
  const Output& output;  ///< must outlive it
};
/// The context of an image with these pixels.
ErrorContext error_context(const CompiledScene& scene, std::span<const float> rgb);

/// Largest effects of the rays that limits of the document ended.
struct TruncationBounds {
  /// Squared errors, summed over the channels, by pixel; empty if the image has all rays. Each pixel has a little,
  /// since its own samples need not show what others lack.
  std::vector<float> squared{};
  double sum = 0;
  double throughput = 0;  ///< mean over the ended rays of a drawn pixel
};
/// `omitted`: means of Tracer::omitted() over the samples of each pixel. `value`: the image's pixel at a place.
/// `radiance`: of an omitted ray, at most.
TruncationBounds truncation_bounds(std::span<const float> omitted, const std::function<Color(std::size_t)>& value,
                                   double radiance, const DisplayTransform& display);

/// Root mean square over the channels of a squared error that is their sum.
inline float rms_of_channels(double squared) { return static_cast<float>(std::sqrt(squared / 3)); }

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

/// Raises `variances`, those of whole rows from `first_row` on, where light is rare and bright, as a lamp that paths
/// find by chance in a mirror: most pixels then have no sample of it and hence no deviation, and it is cut off at white
/// in the others. Each cell of about a thousand pixels gets the mean squared distance of its pixels from the cell's
/// mean, as far as chance causes it. A cell without any sample of the light gets nothing. Returns the uncertainty that
/// this adds. Cells of which chance causes less than `chance_min` of the spread are left out.
SummedErrors add_rare_light(const UniformPixels& pixels, const DisplayTransform& display, std::size_t first_row,
                            std::span<float> variances, double chance_min = 0);

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
  UniformVariance(UniformVariance&&) = delete;

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
/// writes the layer `error`, without `omitted`, if `image` has one.
ErrorEstimate measure_uniform_errors(Image& image, const UniformPixels& pixels, const OmittedError& omitted,
                                     const ErrorContext& context, const InParallel& in_parallel);

}  // namespace tracer
