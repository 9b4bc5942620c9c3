#pragma once
/// Values of a packet, one for each lane: vectors, colors, masks, and compaction of the active lanes.

#include <bit>
#include <cstdint>

#include "tracer/src/math/vec.h"

/// Marks functions that must be inlined into a loop over the lanes of a packet to vectorize it.
#define WHITTLE_INLINE inline __attribute__((always_inline))

/// Marks functions with such loops: one clone per instruction set is compiled and selected at load time. The binary
/// runs on any x86-64-v2 machine. No clone may contract a*b+c (-ffp-contract=off), so all are bit-identical. Disabled
/// with sanitizers, which start after the resolvers run, and in a build for AVX2 alone.
#if defined(__GNUC__) && !defined(__clang__) && !defined(WHITTLE_SANITIZED) && !defined(WHITTLE_AVX2)
#define WHITTLE_WIDE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define WHITTLE_WIDE
#endif

namespace tracer {

/// Lanes of a packet: one vector of floats, two of doubles, on the widest machines.
inline constexpr int lanes = 16;

struct alignas(64) VecLanes {
  double x[lanes], y[lanes], z[lanes];
  [[nodiscard]] WHITTLE_INLINE Vec3 operator[](int i) const { return {x[i], y[i], z[i]}; }
  WHITTLE_INLINE void set(int i, const Vec3& v) {
    x[i] = v.x;
    y[i] = v.y;
    z[i] = v.z;
  }
};

struct alignas(64) ColorLanes {
  double r[lanes], g[lanes], b[lanes];
  [[nodiscard]] WHITTLE_INLINE Color operator[](int i) const { return {r[i], g[i], b[i]}; }
  WHITTLE_INLINE void set(int i, const Color& c) {
    r[i] = c.r;
    g[i] = c.g;
    b[i] = c.b;
  }
};

/// `condition ? a : b` by components: a conditional copy of the whole keeps a loop over lanes from being vectorized.
WHITTLE_INLINE Vec3 select(bool condition, const Vec3& a, const Vec3& b) {
  return {condition ? a.x : b.x, condition ? a.y : b.y, condition ? a.z : b.z};
}

/// One bit per lane.
using LaneMask = std::uint32_t;
inline constexpr LaneMask all_lanes = (LaneMask{1} << lanes) - 1;

/// The first `count` lanes.
inline LaneMask first_lanes(int count) { return (LaneMask{1} << count) - 1; }

/// The mask with the bit of lane i, or no bit.
WHITTLE_INLINE LaneMask lane_bit(int i, bool set = true) { return set ? LaneMask{1} << i : 0; }

/// Calls `action(lane)` for each lane of the mask, in ascending order.
template <class Action>
inline void for_each_lane(LaneMask mask, const Action& action) {
  for (; mask != 0; mask &= mask - 1) action(std::countr_zero(mask));
}

/// Source and destination of one trivially copyable component of a packet.
struct Compressed {
  const void* from;
  void* to;
};

/// Writes the lanes of the mask contiguously, in ascending order, for `count` components with values of eight or four
/// bytes. May overwrite the destination after them, up to sixteen values.
void compress_eights(const Compressed* components, int count, LaneMask mask);
void compress_fours(const Compressed* components, int count, LaneMask mask);

}  // namespace tracer
