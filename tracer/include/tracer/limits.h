#pragma once
/// The bounds within which a scene is accepted. Each has a name, a default with its reason, and an issue
/// (code "limit_exceeded") that tells the name and the value seen. Document-level limits (bytes, nesting) are in api.

#include <cstdint>

namespace tracer {

struct Limits {
  std::uint64_t pixels = 64ull << 20;  ///< 64 Mpx: 8K twice over, 768 MiB of float RGB
  /// Minutes to hours on two cores; more is a mistake. Where samples adapt, of those that every pixel gets.
  std::uint64_t samples_times_pixels = 1ull << 34;
  std::uint32_t max_depth = 1'000'000;   ///< a mirror corridor of that depth runs in constant memory
  std::uint64_t objects = 4'000'000;     ///< instances counted out; about 1 GiB while compiled
  std::uint64_t triangles = 40'000'000;  ///< likewise; about 6 GiB while compiled
  std::uint32_t instance_depth = 16;     ///< prototypes within prototypes; models of the world need 3 or 4
  std::uint32_t lights = 100'000;
  std::uint32_t materials = 100'000;  ///< those written in place included
  std::uint32_t textures = 100'000;   ///< likewise
  std::uint32_t assets = 10'000;      ///< files named, each once
  std::uint32_t octaves = 32;         ///< of noise: the last is 2^31 times as fine as the first
  std::uint32_t image_side = 65'536;  ///< the longest side that PNG and EXR readers take for granted
  double coordinate_max = 1e60;       ///< of positions, lengths, directions: fourth powers stay far from overflow
  double length_min = 1e-60;          ///< of radii and directions: fourth powers stay normal numbers
  double value_max =
      1e30;  ///< of colours, intensities, coefficients, texture scales, `ior` and 1/`ior`; floats hold it
};

/// Of one texture image, checked against what its header says before anything is read. Not part of Limits: they bound
/// what a file's bytes may do to this process, whoever asks.
struct TextureImageLimits {
  std::uint64_t pixels = 64ull << 20;  ///< 64 Mpx
  std::uint64_t channels = 8;
  std::uint64_t bytes = 256'000'000;  ///< of linear float RGB, as it is held: 21 Mpx
};

}  // namespace tracer
