#pragma once
/// Signature of a sample: the surfaces and lights that it meets. Neighboring samples with equal signatures see the same
/// surfaces; samples with different ones have an edge between them.

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "tracer/src/math/sampling.h"
#include "tracer/src/math/vec.h"

namespace tracer {

struct SampleSignature {
  std::uint32_t surface = 0;            ///< hash of the first surface; 0: the ray escaped
  std::array<std::int8_t, 3> normal{};  ///< at the first surface, times 127
  std::uint8_t lit = 0, occluded = 0;   ///< lights that reach the first surface, and those that are occluded, modulo 8
  std::uint8_t detail = 0;              ///< expected error of the sample by texture within the pixel, in code values
  std::uint16_t secondary = 0;          ///< sum of hashes of later surfaces, lights occluded there, and small textures
  std::array<std::uint16_t, 2> cell{};  ///< cell of the texture at the first surface, modulo 2^16; see texture_cell()
  std::uint16_t rays = 1;               ///< after all that differ() compares

  /// Returns use(field...) with all fields.
  template <class Use>
  auto with_fields(const Use& use) {
    return use(surface, normal[0], normal[1], normal[2], lit, occluded, secondary, rays, cell[0], cell[1], detail);
  }
  void add_surface(std::uint32_t hash, const Vec3& n) {
    surface = hash | 1;
    normal = {static_cast<std::int8_t>(n.x * 127), static_cast<std::int8_t>(n.y * 127),
              static_cast<std::int8_t>(n.z * 127)};
  }
  void add_secondary(std::uint64_t hash) {
    secondary = static_cast<std::uint16_t>(secondary + (mix(hash) >> 48));
    count_ray();
  }
  void add_light(std::uint32_t light, std::uint32_t depth, bool reaches) {
    count_ray();
    if (depth == 0) {
      (reaches ? lit : occluded) |= static_cast<std::uint8_t>(1u << (light & 7));
    } else if (!reaches) {
      secondary = static_cast<std::uint16_t>(secondary + (mix(~std::uint64_t{light * 64 + depth}) >> 48));
    }
  }
  void count_ray() { rays = static_cast<std::uint16_t>(rays + (rays < 0xffff ? 1 : 0)); }
};

/// True if an edge lies between the samples.
inline bool differ(const SampleSignature& a, const SampleSignature& b) {
  // Most neighbors are equal: they differ only if one of nine lights reaches the surface and another is occluded.
  if (std::memcmp(&a, &b, offsetof(SampleSignature, rays)) == 0) return (a.lit & a.occluded) != 0;
  if (a.surface != b.surface || a.secondary != b.secondary) return true;
  if (((a.lit & b.occluded) | (a.occluded & b.lit)) != 0) return true;
  // Detail of the texture may lie between the samples if their cells do not touch.
  for (std::size_t axis = 0; axis < 2; ++axis)
    if (static_cast<std::uint16_t>(a.cell[axis] - b.cell[axis] + 1) > 2) return true;
  const int cosine = a.normal[0] * b.normal[0] + a.normal[1] * b.normal[1] + a.normal[2] * b.normal[2];
  return a.surface != 0 && cosine < 14800;  // 0.92 of 127^2: 23 degrees
}

}  // namespace tracer
