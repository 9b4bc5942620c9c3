#pragma once
/// The image during adaptive sampling: means, their errors and layers.

#include <optional>
#include <span>
#include <vector>

#include "tracer/render.h"
#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/sampling/class_allocation.h"
#include "tracer/src/sampling/error_estimate.h"
#include "tracer/src/sampling/image_error.h"
#include "tracer/src/sampling/pixel_classes.h"
#include "tracer/src/sampling/pixel_sums.h"
#include "tracer/src/sampling/sample_sets.h"
#include "tracer/src/sampling/tile_errors.h"

namespace tracer {

/// A place is the index of a pixel in the window, row by row. Functions of one place may run concurrently for different
/// places; all others exclude each other.
class Film {
 public:
  /// `window`: the pixels of the film. The arguments must outlive it.
  Film(const CompiledScene& scene, const PixelWindow& window, SampleDecay decay);

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::uint32_t width() const { return width_; }
  [[nodiscard]] std::uint32_t height() const { return static_cast<std::uint32_t>(size_ / std::max(1u, width_)); }
  [[nodiscard]] std::span<const float> rgb() const { return rgb_; }

  /// Stores a pilot for the `side` x `side` pixels right of and below `place`.
  void set_pilot(std::size_t place, std::uint32_t side, const Color& radiance, const SampleSignature& signature);
  /// Fills a block with the pixel at `source`.
  void fill_block(std::size_t place, std::uint32_t side, std::size_t source);
  [[nodiscard]] const std::vector<SampleSignature>& signatures() const { return signatures_; }
  void forget_signatures() { signatures_ = {}; }

  /// Keeps the pilot of a pixel without samples as a part of its mean; otherwise the first samples replace it.
  /// `weight`: relative to one sample.
  void keep_pilot(std::size_t place, double weight) { weight_[place] = static_cast<float>(weight); }
  /// Adds the samples of a pixel. Means of sets are weighted by the inverse of their variances: a large set of strata
  /// is worth more than the same samples in two sets.
  void add(std::size_t place, const SetSums& sums);
  /// Weight that `count` further samples of a pixel will have in its mean.
  [[nodiscard]] double share_of(std::size_t place, double count) const {
    const double fresh = 1 / decay_.of(count);
    return fresh / (fresh + weight_[place]);
  }
  /// Multiplies the estimated squared errors, for a display of other contrast.
  void scale_errors(double scale);
  /// Adds the deviation of samples of a pixel, which have `share` of its mean.
  void add_deviation(std::size_t place, double share, const Color& deviation);
  /// Standard deviations of the means, three channels per pixel; empty in scenes without random choices.
  [[nodiscard]] std::span<const float> deviations() const { return deviation_; }
  [[nodiscard]] std::optional<Color> deviation(std::size_t place) const {
    if (deviation_.empty()) return std::nullopt;
    return Color{deviation_[3 * place], deviation_[3 * place + 1], deviation_[3 * place + 2]};
  }
  /// Expected squared error of the mean with its samples, relative to that of one.
  [[nodiscard]] double decay(std::size_t place) const { return 1 / weight_[place]; }
  /// Stores the ended rays and the layers of a pilot.
  void add_pilot_sums(std::size_t place, const std::vector<float>& omitted, const GBuffer& gbuffer, std::size_t sample);

  [[nodiscard]] Color mean(std::size_t place) const {
    return {rgb_[3 * place], rgb_[3 * place + 1], rgb_[3 * place + 2]};
  }
  /// Number of samples in the mean, with a pilot that was kept; 0: it is a pilot.
  [[nodiscard]] std::uint32_t count(std::size_t place) const { return count_[place]; }
  /// Estimated squared error of the mean, in squared code values, summed over the channels.
  [[nodiscard]] float& error(std::size_t place) { return error_[place]; }
  [[nodiscard]] float error(std::size_t place) const { return error_[place]; }

  /// Null if the scene has none.
  [[nodiscard]] LayerAccumulator* layers(std::size_t place) { return layers_.empty() ? nullptr : &layers_[place]; }
  /// Tracer::omitted() of the pilots; empty if nothing can be left out.
  [[nodiscard]] std::span<float> omitted() { return omitted_; }

  /// Moves the image and its layers into `rendered` and counts its samples; ends the film. `errors`: squared errors of
  /// the pixels, for the layer `error`. `pilots`: the number of pixels with a sample of their own.
  void write(Rendered& rendered, std::span<const float> errors, std::uint64_t pilots, const InParallel& in_parallel);

 private:
  const CompiledScene& scene_;
  SampleDecay decay_;
  std::uint32_t width_;
  std::size_t size_;
  std::vector<float> rgb_;  ///< three channels per pixel
  std::vector<std::uint32_t> count_;
  std::vector<float> weight_;  ///< weight of the mean, relative to one sample; 0 for a pilot that is not kept
  std::vector<float> error_;
  std::vector<float> deviation_;             ///< see deviations()
  std::vector<SampleSignature> signatures_;  ///< those of the pilots
  std::vector<LayerAccumulator> layers_;     ///< empty in scenes without layers
  std::vector<float> omitted_;               ///< see omitted()
};

}  // namespace tracer
