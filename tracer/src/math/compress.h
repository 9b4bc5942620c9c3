#pragma once
/// Which lanes of a packet count, and how they are brought together.

#include <bit>
#include <cstdint>

#include "tracer/src/math/wide.h"

namespace tracer {

/// A bit for each lane.
using LaneMask = std::uint32_t;
inline constexpr LaneMask all_lanes = (LaneMask{1} << lanes) - 1;

/// The first `count` lanes.
inline LaneMask first_lanes(int count) { return (LaneMask{1} << count) - 1; }

/// Runs `action(lane)` for each lane of the mask, in their order.
template <class Action>
inline void for_each_lane(LaneMask mask, const Action& action) {
  for (; mask != 0; mask &= mask - 1) action(std::countr_zero(mask));
}

/// A packet's component, trivially copyable, and where those of its lanes go that count.
struct Compressed {
  const void* from;
  void* to;
};

/// Writes the lanes of the mask one behind the other, in their order: of `count` components whose values are eight, or
/// four, bytes each. Behind them anything may be written, up to the room of sixteen.
void compress_eights(const Compressed* components, int count, LaneMask mask);
void compress_fours(const Compressed* components, int count, LaneMask mask);

}  // namespace tracer
