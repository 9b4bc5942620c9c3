#pragma once
/// The error of a picture that was made with approximations, measured against exact samples of some of its pixels.

#include <algorithm>

#include "tracer/src/accuracy/account.h"
#include "tracer/src/integrator/camera_rays.h"
#include "tracer/src/integrator/parallel.h"
#include "tracer/src/integrator/tiles.h"
#include "tracer/src/integrator/wavefront_pool.h"

namespace tracer {

template <class Model>
class ExactError {
 public:
  ExactError(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control)
      : scene_(scene),
        settings_(settings),
        control_(control),
        tiles_(scene.image.window()),
        pool_(scene, control, {}) {}

  /// Of the whole picture, from two independent halves of exact samples in each pixel that is chosen; see
  /// pixel_state.h. Adds what was traced to `statistics`. Throws std::bad_alloc.
  SampledError measure(const Image& image, const Levels& levels, RenderStatistics& statistics) {
    std::vector<AuditedError> of_tile(tiles_.count());
    for_each_tile(tiles_.count(), settings_.threads, [&](std::uint64_t tile) {
      if (control_.cancelled()) return;
      typename WavefrontPool<Model>::Lease wavefront(pool_);
      of_tile[tile] = measure_tile(tile, *wavefront, image, levels);
    });
    AuditedError all;
    for (const AuditedError& one : of_tile) all.add(one);
    RenderStatistics traced = pool_.statistics();
    traced.audit_samples = traced.samples;
    add(statistics, traced);
    return all.of(image.rgb.size() / 3).known();
  }

 private:
  static constexpr std::uint32_t half_samples = 4;
  static constexpr std::uint32_t light_points = 2;
  static constexpr std::uint64_t streams = std::uint64_t{1} << 40;  ///< beyond those of all rounds

  AuditedError measure_tile(std::uint64_t tile, Wavefront<Model>& wavefront, const Image& image, const Levels& levels) {
    Batch batch;
    batch.light_points = light_points;
    std::vector<PixelState> chosen;
    for (const Pixel& pixel : tiles_.pixels(tile)) {
      const std::size_t place = tiles_.place(pixel);
      if (!chooses(place)) continue;
      const float* rgb = image.rgb.data() + 3 * place;
      PixelState& state = chosen.emplace_back();
      state.sum = {rgb[0], rgb[1], rgb[2]};
      state.count = 1;
      for (std::uint32_t half = 0; half < 2; ++half)
        for (std::uint32_t index = 0; index < half_samples; ++index)
          push(batch, scene_, fresh_sample(scene_, pixel.x, pixel.y, index, half_samples, streams + half));
    }
    AuditedError sum;
    if (chosen.empty() || !wavefront.trace(std::move(batch))) return sum;
    for (std::size_t i = 0; i < wavefront.radiance().size(); ++i) {
      if (!finite(wavefront.radiance()[i])) continue;
      const std::size_t half = i / half_samples;
      chosen[half / 2].fresh[half % 2] += wavefront.radiance()[i];
      ++chosen[half / 2].fresh_count[half % 2];
    }
    for (const PixelState& pixel : chosen)
      if (pixel.fresh_count[0] > 0 && pixel.fresh_count[1] > 0) sum.add(error_of(pixel, levels).before);
    return sum;
  }

  /// A thirty-second of the pixels, or as many as tell the error of a small picture.
  [[nodiscard]] bool chooses(std::size_t place) const {
    constexpr double enough = 2048;
    const double share = std::clamp(enough / static_cast<double>(scene_.image.window().pixels()), 1.0 / 32, 1.0);
    return static_cast<double>(mix(mix(place) ^ mix(scene_.accuracy.seed)) >> 11) * 0x1p-53 < share;
  }

  const CompiledScene& scene_;
  const RenderSettings& settings_;
  RenderControl& control_;
  Tiles tiles_;
  WavefrontPool<Model> pool_;
};

/// Joins what was measured to the estimate of a picture whose approximations it did not know of: these are the part
/// that `sampling` and the rest do not explain.
template <class Model>
void account_for_approximations(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control,
                                const Levels& levels, Rendered& rendered) {
  if (!scene.accuracy.approximate.any()) return;
  ExactError<Model> exact(scene, settings, control);
  const SampledError whole = exact.measure(rendered.image, levels, rendered.statistics);
  add_approximation(rendered.error, whole, rendered.image.rgb.size() / 3);
  rendered.error.met = !rendered.error.target || rendered.error.estimate <= *rendered.error.target;
}

}  // namespace tracer
