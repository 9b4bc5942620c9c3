#pragma once
/// Traces tiles with the same number of samples in every pixel.

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "tracer/src/integrators/tracer.h"
#include "tracer/src/sampling/camera_samples.h"
#include "tracer/src/sampling/image_error.h"
#include "tracer/src/sampling/part_bytes.h"
#include "tracer/src/sampling/pixel_sums.h"
#include "tracer/src/sampling/tiles.h"

namespace tracer {

/// The pixels of a window. Functions of different tiles may run concurrently.
struct UniformFilm {
  UniformFilm(const CompiledScene& scene, const PixelWindow& window) : tiles(window) {
    allocate(image, window, scene.output);
    if (scene.accuracy.samples > 1) deviation.resize(image.rgb.size());
    if (scene.accuracy.truncates()) omitted.resize(window.pixels());
  }

  /// Writes the tile as result of a part.
  void write_tile(std::uint64_t tile, PartWriter& writer) {
    for (const Pixel& pixel : tiles.pixels(tile)) {
      const std::size_t place = tiles.place(pixel);
      each_plane([&](auto& plane, std::size_t channels) {
        for (std::size_t i = channels * place; i < channels * (place + 1); ++i) writer.put(plane[i]);
        return true;
      });
    }
  }

  /// Reads what write_tile() of an equal tile has written. False if it is something else; the tile is then undefined.
  bool read_tile(std::uint64_t tile, PartReader& reader) {
    for (const Pixel& pixel : tiles.pixels(tile)) {
      const std::size_t place = tiles.place(pixel);
      const bool read = each_plane([&](auto& plane, std::size_t channels) {
        for (std::size_t i = channels * place; i < channels * (place + 1); ++i)
          if (!(&plane == static_cast<void*>(&image.layers.depth) ? reader.get_any(plane[i]) : reader.get(plane[i])))
            return false;
        return true;
      });
      if (!read) return false;
    }
    return true;
  }

  Tiles tiles;
  Image image;
  std::vector<float> deviation;  ///< standard deviation of each pixel's mean, three channels; empty for one sample
  std::vector<float> omitted;    ///< mean of Tracer::omitted() over each pixel's samples; empty if all are traced

 private:
  /// Calls use(values, channels) for each array that samples fill; returns whether all calls returned true.
  template <class Use>
  bool each_plane(const Use& use) {
    const auto used = [&](auto& plane, std::size_t channels) { return plane.empty() || use(plane, channels); };
    Layers& layers = image.layers;
    return used(image.rgb, 3) && used(deviation, 3) && used(omitted, 1) && used(image.alpha, 1) &&
           used(layers.depth, 1) && used(layers.normal, 3) && used(layers.albedo, 3) && used(layers.object_id, 1) &&
           used(layers.samples, 1);
  }
};

class UniformTracer {
 public:
  /// The arguments must outlive it.
  UniformTracer(const CompiledScene& scene, UniformFilm& film)
      : scene_(scene), film_(film), samples_(scene.accuracy.samples) {}

  /// Returns false if cancelled. Different tiles may be traced concurrently.
  bool trace_tile(std::uint64_t index, Tracer& tracer) {
    const std::vector<Pixel> pixels = film_.tiles.pixels(index);
    const std::size_t at_once = std::max(batch_pixels_min, batch_rays / samples_);
    for (std::span<const Pixel> left = pixels; !left.empty(); left = left.subspan(std::min(at_once, left.size())))
      if (!trace_pixels(left.first(std::min(at_once, left.size())), tracer)) return false;
    return true;
  }

 private:
  /// Camera rays per batch: enough to fill packets after most rays have escaped, few enough for the L2 cache. A batch
  /// has all samples of some pixels, or some samples of as many pixels as a packet has lanes.
  static constexpr std::uint32_t batch_rays = 4096, batch_pixels_min = lanes;
  /// A penumbra with 16 stratified points per pixel has a standard error of at most about 3 % of the light.
  static constexpr std::uint32_t light_points_min = 16;

  /// Sums over a pixel's samples. Layers are separate, since few scenes have any.
  struct Sums {
    PixelAccumulator radiance, half;
    float omitted = 0;
  };

  bool trace_pixels(std::span<const Pixel> pixels, Tracer& tracer) {
    std::array<Sums, batch_pixels_min> partial;  // of pixels with more samples than a batch
    std::array<LayerAccumulator, batch_pixels_min> partial_layers;
    const std::uint32_t at_once = std::max(1u, batch_rays / static_cast<std::uint32_t>(pixels.size()));
    for (std::uint32_t first = 0, last = 0; first < samples_; first = last) {
      last = first + std::min(at_once, samples_ - first);
      fill(tracer.batch(), scene_, pixels, {first, last, samples_});
      tracer.batch().light_points = (light_points_min + samples_ - 1) / samples_;
      if (!tracer.trace()) return false;
      if (samples_ == 1) write_each(pixels, tracer);
      const BatchPart part{pixels.size(), first, last == samples_};
      if (samples_ > 1)
        accumulate(part, tracer, partial,
                   [&](std::size_t i, const Sums& sums) { write(sums, film_.tiles.place(pixels[i])); });
      if (scene_.needs.layers)
        accumulate(part, tracer, partial_layers, [&](std::size_t i, const LayerAccumulator& sums) {
          sums.write(film_.image, film_.tiles.place(pixels[i]));
        });
    }
    return true;
  }

  /// Writes pixels with one sample each, without sums.
  void write_each(std::span<const Pixel> pixels, const Tracer& tracer) {
    const std::vector<Color>& radiance = tracer.radiance();
    const std::vector<float>& omitted = tracer.omitted();
    const Tiles tiles = film_.tiles;  // local copies, read once and not for each pixel
    float* const film = film_.image.rgb.data();
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const Color& sample = radiance[i];
      if (!finite(sample)) continue;  // counted by the tracer; the pixel stays black
      write_color(film + 3 * tiles.place(pixels[i]), sample);
    }
    for (std::size_t i = 0; i < omitted.size(); ++i) film_.omitted[tiles.place(pixels[i])] = omitted[i];
  }

  /// Batch of some samples of all pixels, the first sample of all pixels first.
  struct BatchPart {
    std::size_t pixels;
    std::uint32_t first;  ///< index of the first sample
    bool last;
  };
  /// Accumulates the batch's samples of each pixel; calls write(i, sums) after the last part.
  template <class Sum, class Write>
  void accumulate(const BatchPart& part, const Tracer& tracer, std::array<Sum, batch_pixels_min>& partial,
                  const Write& write) const {
    const std::size_t samples = tracer.radiance().size();
    for (std::size_t i = 0; i < part.pixels; ++i) {
      Sum sums;
      if (part.first > 0) sums = partial[i];
      std::uint32_t index = part.first;
      for (std::size_t sample = i; sample < samples; sample += part.pixels, ++index)
        if (finite(tracer.radiance()[sample])) add_sample(tracer, sample, index, sums);  // others are counted
      if (part.last) {
        write(i, sums);
      } else {
        partial[i] = sums;
      }
    }
  }

  void add_sample(const Tracer& tracer, std::size_t sample, std::uint32_t /*index*/, LayerAccumulator& sums) const {
    sums.add(tracer.gbuffer(), sample);
  }
  /// The first half of a pixel's sequence is stratified by itself, and so is the second.
  void add_sample(const Tracer& tracer, std::size_t sample, std::uint32_t index, Sums& sums) const {
    const Color& radiance = tracer.radiance()[sample];
    sums.radiance.add(radiance);
    if (index < samples_ / 2) sums.half.add(radiance);
    if (!tracer.omitted().empty()) sums.omitted += tracer.omitted()[sample];
  }

  void write(const Sums& sums, std::size_t at) {
    sums.radiance.write(film_.image.rgb.data() + 3 * at);
    if (!film_.deviation.empty()) sums.radiance.write_deviation(sums.half, film_.deviation.data() + 3 * at);
    if (!film_.omitted.empty()) film_.omitted[at] = sums.omitted / static_cast<float>(samples_);
  }

  const CompiledScene& scene_;
  UniformFilm& film_;
  std::uint32_t samples_;
};

}  // namespace tracer
