#pragma once
/// Traces the samples that a round of adaptive sampling allocates.

#include <cstdint>
#include <mutex>
#include <vector>

#include "tracer/src/integrators/tracer_concept.h"
#include "tracer/src/sampling/camera_samples.h"
#include "tracer/src/sampling/deadline.h"
#include "tracer/src/sampling/film.h"
#include "tracer/src/sampling/tiles.h"

namespace tracer {

template <Tracer T>
class RoundTracer {
 public:
  /// The arguments must outlive it.
  RoundTracer(const CompiledScene& scene, const RenderControl& control, Film& film, const Tiles& tiles,
              const Deadline& deadline, PreviewTiles& preview)
      : scene_(scene), control_(control), film_(film), tiles_(tiles), deadline_(deadline), preview_(preview) {}

  /// Continues the halves of the tile's pixels up to `half` samples each, by place; 0: unchanged. One thread at a time
  /// for each tile.
  void trace(std::uint64_t tile, const std::vector<std::uint32_t>& half, T& tracer) {
    const std::size_t at_once = deadline_.set() ? batch_rays_with_deadline : batch_rays;
    Batch& batch = tracer.batch();
    batch.clear();
    std::vector<SampleTarget> targets;
    PreviewTiles::Tile preview(preview_, tile);
    std::unique_lock lock(preview);
    const auto trace = [&] {
      batch.light_points = fresh_light_points;
      lock.unlock();
      const bool traced = !targets.empty() && !control_.cancelled() &&
                          !deadline_.over_before(static_cast<double>(targets.size())) && tracer.trace();
      lock.lock();
      if (traced) add_samples(tracer, targets);
      batch.clear();
      targets.clear();
    };
    for (const Pixel& pixel : tiles_.pixels(tile)) {
      if (const std::uint32_t count = half[tiles_.place(pixel)]; count > 0) push_samples(batch, targets, pixel, count);
      if (targets.size() >= at_once) trace();
    }
    trace();
  }

 private:
  static constexpr std::uint32_t batch_rays = 4096, batch_rays_with_deadline = 1024;
  static constexpr std::uint32_t fresh_light_points = 1;  ///< points per area light of fresh samples; see pilot.h
  /// Fresh samples are point samples: the effect of filtering textures over the pixel is an error that they measure.
  static constexpr double fresh_share = 0;

  /// The pixel and half that a sample of a batch is added to.
  struct SampleTarget {
    std::size_t place;
    std::uint8_t half;
  };

  /// Continues the sequences of the pixel's halves up to `count` samples each.
  void push_samples(Batch& batch, std::vector<SampleTarget>& targets, const Pixel& pixel, std::uint32_t count) {
    const std::size_t place = tiles_.place(pixel);
    const PixelState& state = film_.pixel(place);
    for (std::uint8_t half = 0; half < 2; ++half) {
      for (std::uint32_t index = state.half_count[half]; index < count; ++index) {
        Sample sample = fresh_sample(scene_, pixel.x, pixel.y, index, half);
        sample.share = fresh_share;
        push(batch, scene_, sample);
        targets.push_back({place, half});
      }
    }
  }

  /// A pixel belongs to one tile, and so to one thread at a time.
  void add_samples(const T& tracer, const std::vector<SampleTarget>& targets) {
    for (std::size_t i = 0; i < targets.size(); ++i) {
      const Color& radiance = tracer.radiance()[i];
      if (!finite(radiance)) continue;  // counted by the tracer
      PixelState& pixel = film_.pixel(targets[i].place);
      if (!pixel.begun()) film_.discard_samples(targets[i].place);  // the pilot
      pixel.half[targets[i].half] += radiance;
      ++pixel.half_count[targets[i].half];
      pixel.add_square(radiance);
      film_.add_sample(targets[i].place, tracer.omitted(), tracer.gbuffer(), i);
    }
  }

  const CompiledScene& scene_;
  const RenderControl& control_;
  Film& film_;
  const Tiles& tiles_;
  const Deadline& deadline_;
  PreviewTiles& preview_;
};

}  // namespace tracer
