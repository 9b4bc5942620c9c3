#pragma once
/// A picture while samples are being added to it in rounds: what is known of its pixels, and what is kept beside.

#include <span>
#include <vector>

#include "tracer/render.h"
#include "tracer/src/accuracy/account.h"
#include "tracer/src/integrator/picture_error.h"
#include "tracer/src/integrator/pixel_sum.h"
#include "tracer/src/integrator/scouts.h"

namespace tracer {

/// Places are those of the window's pixels, row by row. One thread at a time for each place; the rest when no other is
/// at work.
class Film {
 public:
  explicit Film(const CompiledScene& scene);

  [[nodiscard]] std::span<PixelState> pixels() { return pixels_; }
  [[nodiscard]] PixelState& pixel(std::size_t place) { return pixels_[place]; }
  [[nodiscard]] std::size_t size() const { return pixels_.size(); }
  [[nodiscard]] std::uint32_t width() const { return width_; }

  /// What a sample that counts lacks and hits.
  void note(std::size_t place, const std::vector<MissingLight>& missing, const FirstHits& hits, std::size_t sample);
  /// Forgets what was noted of the place's samples.
  void forget(std::size_t place);
  void copy_notes(std::size_t to, std::size_t from);
  /// What a scout saw in the pixel at `place`.
  void note(std::size_t place, const Scout& scout, const Color& radiance, const Levels& levels);

  /// Sets what the pilots let expect of every pixel, before anything is measured.
  void expect(const Levels& levels);

  [[nodiscard]] Levels levels() const;
  [[nodiscard]] std::vector<Color> means() const;
  [[nodiscard]] MissingError missing_error(const Levels& levels) const;

  /// The picture and what was asked for beside it, into `rendered`, with the counts of its samples; `sampled` is what
  /// is claimed of it. `rendered.statistics.samples` counts all samples.
  void write(Rendered& rendered, const SampledError& sampled) const;

 private:
  /// Means, as the picture has them.
  struct Means {
    std::vector<float> rgb;
    std::vector<MissingLight> missing;
  };
  [[nodiscard]] Means written() const;
  [[nodiscard]] std::vector<float> claimed_variances(const SampledError& sampled) const;

  const CompiledScene& scene_;
  std::uint32_t width_;
  std::vector<PixelState> pixels_;
  std::vector<LayerSum> layers_;       ///< empty where none is asked for
  std::vector<MissingLight> missing_;  ///< sums; empty where nothing can be missing
};

}  // namespace tracer
