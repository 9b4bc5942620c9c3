#pragma once
/// Lane masks of packets, and compaction of the active lanes.

#include <bit>
#include <cstdint>

#include "tracer/src/math/wide.h"

namespace tracer {

/// One bit per lane.
using LaneMask = std::uint32_t;
inline constexpr LaneMask all_lanes = (LaneMask{1} << lanes) - 1;

/// The first `count` lanes.
inline LaneMask first_lanes(int count) { return (LaneMask{1} << count) - 1; }

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
