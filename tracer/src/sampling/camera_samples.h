#pragma once
/// Generates the samples of pixels and adds them to a batch.

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/integrators/tracer.h"
#include "tracer/src/math/lanes.h"
#include "tracer/src/math/sampling.h"
#include "tracer/src/sampling/tiles.h"

namespace tracer {

/// One sample of the pixel (x, y) of the full image.
struct Sample {
  std::uint32_t x = 0, y = 0;
  Vec2 at;           ///< position in the pixel, in [0,1)^2
  Vec2 lens;         ///< in [0,1)^2; ignored by pinhole cameras
  double share = 1;  ///< fraction of the pixel's width that textures are filtered over
  Batch::Sample seeds;
};

inline void push(Batch& batch, const CompiledScene& scene, const Sample& sample) {
  batch.samples.push_back(sample.seeds);
  batch.x.push_back(sample.x + sample.at.x);
  batch.y.push_back(sample.y + sample.at.y);
  if (scene.needs.lens) batch.lens.push_back(sample.lens);
  if (scene.needs.filtered_textures) batch.share.push_back(sample.share);
}

/// Index of pixel (x, y) in the full image, row by row: the seed of its random choices.
inline std::uint64_t pixel_index(const CompiledScene& scene, std::uint32_t x, std::uint32_t y) {
  return static_cast<std::uint64_t>(y) * scene.image.width + x;
}

/// Fraction of the pixel's width that each of `count` samples covers.
inline double uniform_share(std::uint32_t count) { return 1 / std::sqrt(static_cast<double>(count)); }

/// True if fixed samples filter textures, which changes their mean: a filter is wider than the pixel where the pixel is
/// long and narrow on the texture, and light depends on normals, and on the product of opacity and color, but not on
/// their averages.
inline bool filtering_changes_means(const CompiledScene& scene) {
  const auto filters = [](const Texture& texture) { return texture.filter == Texture::Filter::mipmap; };
  return !scene.accuracy.adaptive && std::ranges::any_of(scene.textures, filters);
}

/// Fraction of the pixel's width over which the samples of looks filter textures. Point samples measure the effect of
/// filtering as an error; what fixed samples average instead is compared with those, which are exact.
inline double look_share(const CompiledScene& scene, bool exact) {
  return !exact && filtering_changes_means(scene) ? uniform_share(scene.accuracy.samples) : 0;
}

/// Sample `index` of `count` of a pixel. The first few of any number are stratified; a single one is at the center.
inline Sample uniform_sample(const CompiledScene& scene, std::uint32_t x, std::uint32_t y, std::uint32_t index,
                             std::uint32_t count) {
  const std::uint64_t key = pixel_key(pixel_index(scene, x, y), scene.accuracy.seed);
  return {x,
          y,
          pixel_sample(key, index, count),
          scene.needs.lens ? lens_sample(key, index, count) : Vec2{0.5, 0.5},
          uniform_share(count),
          {key, index}};
}

/// Range [first, last) of the samples of each pixel, of `count` in total.
struct SampleRange {
  std::uint32_t first, last, count;
};

/// Fills the batch with these samples of these pixels, the first sample of all pixels first. Equal to uniform_sample(),
/// except for the seeds of single samples that chance does not place.
inline void fill(Batch& batch, const CompiledScene& scene, std::span<const Pixel> pixels, const SampleRange& range) {
  const bool lens = scene.needs.lens;
  const std::size_t size = pixels.size() * (range.last - range.first);
  batch.samples.resize(size);
  batch.x.resize(size);
  batch.y.resize(size);
  if (lens) batch.lens.resize(size);
  if (scene.needs.filtered_textures) batch.share.assign(size, uniform_share(range.count));
  const std::uint64_t seed = scene.accuracy.seed;
  if (range.count == 1 && !lens && !has_random_rays(scene.needs)) {
    // Hashing seeds would be most of the work of a simple image beside its rays, and choices of rays hash them again.
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      batch.samples[i] = {pixel_index(scene, pixels[i].x, pixels[i].y) + (seed << 32), 0};
      batch.x[i] = pixels[i].x + 0.5;
      batch.y[i] = pixels[i].y + 0.5;
    }
    return;
  }
  std::size_t i = 0;
  for (std::uint32_t index = range.first; index < range.last; ++index) {
    for (const Pixel& pixel : pixels) {
      const std::uint64_t key = pixel_key(pixel_index(scene, pixel.x, pixel.y), seed);
      const Vec2 at = pixel_sample(key, index, range.count);
      batch.samples[i] = {key, index};
      batch.x[i] = pixel.x + at.x;
      batch.y[i] = pixel.y + at.y;
      if (lens) batch.lens[i] = lens_sample(key, index, range.count);
      ++i;
    }
  }
}

/// Sample `index` of stream `stream` of a pixel, independent of all other streams and of uniform_sample(). The first
/// few of any number are stratified. Inlined into the loops over samples, which saves 1 % of an adaptive render.
WHITTLE_INLINE Sample fresh_sample(const CompiledScene& scene, std::uint32_t x, std::uint32_t y, std::uint32_t index,
                                   std::uint64_t stream) {
  const std::uint64_t key = mix(pixel_key(pixel_index(scene, x, y), scene.accuracy.seed) ^ mix(~stream));
  constexpr std::uint32_t many = std::numeric_limits<std::uint32_t>::max();
  return {x, y,           sequence_point(index, key), scene.needs.lens ? lens_sample(key, index, many) : Vec2{0.5, 0.5},
          1, {key, index}};
}

}  // namespace tracer
