#pragma once
/// The image during adaptive sampling: the state of its pixels, their layers, their omitted radiance, and the features
/// that are too small for their samples.

#include <span>
#include <vector>

#include "tracer/render.h"
#include "tracer/src/certify/pixel_bounds.h"
#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/sampling/error_estimate.h"
#include "tracer/src/sampling/image_error.h"
#include "tracer/src/sampling/pixel_state.h"
#include "tracer/src/sampling/sample_allocation.h"
#include "tracer/src/sampling/subpixel_features.h"
#include "tracer/src/sampling/tile_errors.h"
#include "tracer/src/sampling/tone_error.h"

namespace tracer {

/// A place is the index of a pixel in the window, row by row. Functions of one place may run concurrently for different
/// places; all others exclude each other.
///
/// First the film holds preview blocks: samples of a grid of pixels, each standing for a block of them. This takes
/// little memory and time, since it may be the final image. begin() prepares it for rounds.
class Film {
 public:
  /// `window`: the pixels of the film. The arguments must outlive it.
  Film(const CompiledScene& scene, const PixelWindow& window, const InParallel& in_parallel);

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::uint32_t width() const { return width_; }

  /// Stores a pilot sample for the `side` x `side` pixels right of and below `place`.
  void set_preview_block(std::size_t place, std::uint32_t side, const Color& radiance,
                         const std::vector<OmittedRadiance>& omitted, const GBuffer& gbuffer, std::size_t sample);
  /// Fills a block with the pixel at `source`.
  void fill_block(std::size_t place, std::uint32_t side, std::size_t source);

  /// Creates the states of the pixels from their pilots and the bounds of their radiance; empty: none. Precondition of
  /// the functions on pixels below.
  void begin(std::vector<RadianceInterval> bounds);
  /// Bounds the squared errors of pixels as they are displayed now. Those of at most `certified` per pixel are
  /// certified, and so few that the sum of their bounds is at most a ninth of that for all pixels.
  void certify(double certified);
  [[nodiscard]] std::span<PixelState> pixels() { return pixels_; }
  [[nodiscard]] std::span<const RadianceInterval> bounds() const { return bounds_; }
  [[nodiscard]] PixelState& pixel(std::size_t place) { return pixels_[place]; }
  /// Adds the omitted radiance and the layers of a sample that is in the pixel's mean.
  void add_sample(std::size_t place, const std::vector<OmittedRadiance>& omitted, const GBuffer& gbuffer,
                  std::size_t sample);
  /// Discards the sums of add_sample().
  void discard_samples(std::size_t place);

  /// All that the samples of a pixel change, by reference; null: the scene has none of it.
  struct PixelSums {
    float* rgb;         ///< three channels, before begin()
    PixelState* state;  ///< from begin() on
    OmittedRadiance* omitted;
    LayerAccumulator* layers;
  };
  [[nodiscard]] PixelSums sums(std::size_t place);
  /// Adds the radiance of a subpixel feature at `place`.
  void add_feature(std::size_t place, const SubpixelFeature& feature, const Color& radiance,
                   const DisplayTransform& display);
  /// Predicts the variance of every pixel from the pilots.
  void predict_variance(const DisplayTransform& display);
  /// Raises the variance to a squared error that a look found far above the prediction, and marks the pixel as
  /// repaired. In the neighbors as well: its cause may continue there.
  void raise_variance(std::size_t place, double error);

  [[nodiscard]] DisplayTransform display() const;
  [[nodiscard]] Color mean(std::size_t place) const;
  [[nodiscard]] OmittedError omitted_error(const DisplayTransform& display);
  /// Squared error by the brightest channel (tone_error.h); 0 without `overflow: scale`.
  [[nodiscard]] double tone_error();
  /// Raises the samples of pixels that may be the brightest one, where that may cause a larger squared error than
  /// `tone_max` by the brightest channel, or make it larger by more than a tenth. Pixels that may be brighter come
  /// first, while the new samples cost at most `cost_max`; `cost`: per sample of each pixel.
  void raise_brightest(double tone_max, std::span<const float> cost, double cost_max, const Adaptive& limits,
                       SampleAllocation& allocation);
  /// Predicted errors of the tiles; empty without rounds.
  [[nodiscard]] TileErrors tile_errors() const;
  /// Tiles whose error exceeds `target` levels.
  [[nodiscard]] std::vector<ExcessTile> excess_tiles(double target) const;

  struct Outcome {
    SampledError sampled;
    double open = 0;       ///< error of the open pixels, in squared code values
    bool complete = true;  ///< every pixel has a sample of its own
  };
  /// Moves the image and its layers into `rendered` and counts its samples; ends the film.
  /// `rendered.statistics.samples` is the number of all samples.
  void write(Rendered& rendered, const Outcome& outcome);

 private:
  /// Also sets the ranges of all `pixels`.
  [[nodiscard]] BrightestRange brightest(std::vector<BrightestRange>& pixels) const;
  [[nodiscard]] OmittedRadiance mean_omitted(std::size_t place) const;
  /// Writes the layer `error`: the pixels' variances, scaled up to the estimate of the image. Without rounds, uniform.
  /// The error that looks found is spread over the open pixels in proportion to their bounds.
  void write_errors(std::vector<float>& error, const Image& image, const Outcome& outcome,
                    const ErrorContext& context) const;
  [[nodiscard]] RadianceBound omitted_bound() const;
  void update_means();  ///< writes the means of refined pixels to `rgb_`
  void count(RenderStatistics& statistics) const;

  const CompiledScene& scene_;
  const InParallel& in_parallel_;
  std::uint32_t width_;
  std::size_t size_;
  std::vector<float> rgb_;  ///< three channels per pixel; older than the pixels' means between updates
  std::vector<PixelState> pixels_;
  std::vector<RadianceInterval> bounds_;  ///< one per pixel, or empty
  std::vector<LayerAccumulator> layers_;  ///< empty in scenes without layers
  std::vector<OmittedRadiance> omitted_;  ///< sums; empty in scenes that cannot omit radiance
};

}  // namespace tracer
