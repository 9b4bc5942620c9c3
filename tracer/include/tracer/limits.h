#pragma once
/// Limits of accepted scenes. Each has a name, a default with its reason, and an issue (code "limit_exceeded") that
/// contains the name and the value found. Document-level limits (bytes, nesting) are in api.

#include <cstdint>

namespace tracer {

struct Limits {
  std::uint64_t pixels = 64ull << 20;  ///< 64 Mpx: two 8K images, 768 MiB of float RGB
  /// Minutes to hours on two cores. With adaptive sampling the minimum per pixel counts.
  std::uint64_t samples_times_pixels = 1ull << 34;
  std::uint32_t max_depth = 1'000'000;   ///< a mirror corridor of that depth runs in constant memory
  std::uint64_t objects = 4'000'000;     ///< after instancing; about 1 GiB while compiled
  std::uint64_t triangles = 40'000'000;  ///< after instancing; about 6 GiB while compiled
  std::uint32_t instance_depth = 16;     ///< nested prototypes; large models need 3 or 4
  std::uint32_t lights = 100'000;
  std::uint32_t materials = 100'000;  ///< named and inline
  std::uint32_t textures = 100'000;   ///< named and inline
  std::uint32_t assets = 10'000;      ///< distinct files
  std::uint32_t octaves = 32;         ///< noise: the last octave is 2^31 times as fine as the first
  /// Patches of all surfaces; their rows take 540 MB at most while the scene is compiled.
  std::uint32_t radiosity_patches = 65'536;
  std::uint32_t image_side = 65'536;  ///< the longest side that PNG and EXR readers commonly support
  double coordinate_max = 1e60;       ///< positions, lengths, directions: fourth powers stay far from overflow
  double length_min = 1e-60;          ///< radii and directions: fourth powers stay normal numbers
  /// Colors, intensities, coefficients, texture scales, `ior` and 1/`ior`: representable as float.
  double value_max = 1e30;
};

/// Samples of a pixel, up to `most`, within the default limit of the image, but at least `least`: the default, not the
/// limit in force, since the image depends only on the document.
constexpr std::uint32_t bounded_samples(std::uint32_t most, std::uint32_t least, std::uint64_t pixels) {
  const std::uint64_t bound = pixels == 0 ? most : Limits().samples_times_pixels / pixels;
  return bound >= most ? most : bound <= least ? least : static_cast<std::uint32_t>(bound);
}

/// Limits of one texture image, checked against its header before decoding. They protect the process from decompression
/// bombs and are therefore not part of Limits, which an operator may raise.
struct TextureImageLimits {
  std::uint64_t pixels = 64ull << 20;  ///< 64 Mpx
  std::uint64_t channels = 8;
  std::uint64_t bytes = 256'000'000;  ///< linear float RGB in memory: 21 Mpx
};

}  // namespace tracer
