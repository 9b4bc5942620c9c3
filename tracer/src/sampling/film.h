#pragma once
/// An image while samples are being added to it in rounds: what is known of its pixels, and what is kept beside.

#include <span>
#include <vector>

#include "tracer/render.h"
#include "tracer/src/sampling/error_estimate.h"
#include "tracer/src/sampling/image_error.h"
#include "tracer/src/sampling/pixel_accumulator.h"
#include "tracer/src/sampling/subpixel_features.h"

namespace tracer {

/// Places are those of the window's pixels, row by row. One thread at a time for each place; the rest when no other is
/// at work.
///
/// It begins as a sketch: the samples of a grid of pixels, each standing for a block of them, and finer ones over it.
/// Little is kept of that, so that it may be all there is time for. Once every pixel has its sample, `begin` makes room
/// for rounds.
class Film {
 public:
  Film(const CompiledScene& scene, const InParallel& in_parallel);

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::uint32_t width() const { return width_; }

  /// A pilot, and what it lacks and hits. Stands for the `side` x `side` pixels from `place` on, to the right and down.
  void sketch(std::size_t place, std::uint32_t side, const Color& radiance, const std::vector<OmittedRadiance>& omitted,
              const GBuffer& hits, std::size_t sample);

  /// Makes such a block look like the pixel at `like`.
  void fill_block(std::size_t place, std::uint32_t side, std::size_t like);

  /// Makes pixels of the sketch; only after it does any of what follows here know of pixels.
  void begin();
  [[nodiscard]] std::span<PixelState> pixels() { return pixels_; }
  [[nodiscard]] PixelState& pixel(std::size_t place) { return pixels_[place]; }
  /// What a sample that counts lacks and hits.
  void note(std::size_t place, const std::vector<OmittedRadiance>& omitted, const GBuffer& hits, std::size_t sample);
  /// Forgets what was noted of the place's samples.
  void forget(std::size_t place);
  /// What a scout saw in the pixel at `place`.
  void note(std::size_t place, const SubpixelFeature& scout, const Color& radiance, const DisplayTransform& levels);
  /// Sets what the pilots let expect of every pixel, before anything is measured.
  void expect(const DisplayTransform& levels);

  /// An audit found that squared error in a pixel. What it has and nobody expected may go on in those beside it.
  void suspect(std::size_t place, double error);

  [[nodiscard]] DisplayTransform levels() const;
  [[nodiscard]] Color mean(std::size_t place) const;
  [[nodiscard]] MissingError missing_error(const DisplayTransform& levels);

  /// The image and what was asked for beside it, into `rendered`, with the counts of its samples; `sampled` is what
  /// is claimed of it. `rendered.statistics.samples` counts all samples. `whole`: every pixel has a sample. Ends the
  /// film.
  void write(Rendered& rendered, const SampledError& sampled, bool whole);

 private:
  /// The sums that were noted at a place, as of one sample.
  [[nodiscard]] OmittedRadiance missing_of_one(std::size_t place) const;
  /// The layer, from the pixels' variances, made to add up to what is claimed of the image. A sketch's are all alike.
  void write_errors(std::vector<float>& error, const Image& image, const SampledError& sampled,
                    const ErrorContext& judging) const;
  [[nodiscard]] RadianceBound most_hideable() const;
  void take_means();  ///< of refined pixels, into `rgb_`
  void count(RenderStatistics& statistics) const;

  template <class Work>
  void each_pixel(const Work& work) const;

  const CompiledScene& scene_;
  const InParallel& in_parallel_;
  std::uint32_t width_;
  std::size_t size_;
  std::vector<float> rgb_;  ///< the image, three channels a pixel; behind the pixels' means in between
  std::vector<PixelState> pixels_;
  std::vector<LayerAccumulator> layers_;  ///< empty where none is asked for
  std::vector<OmittedRadiance> omitted_;  ///< sums; empty where nothing can be missing
};

}  // namespace tracer
