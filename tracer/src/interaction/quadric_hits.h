#pragma once
/// Points of sixteen quadrics at once.

#include "tracer/src/interaction/hit_packet.h"

namespace tracer {

/// What a lane's point needs to know of its quadric.
struct alignas(64) QuadricPacket {
  double x[lanes], y[lanes], z[lanes];
  double to_shape[9][lanes], from_shape[9][lanes];  ///< by columns
  double kind[lanes], part[lanes];                  ///< numbers: loops over doubles compare them
  double radius_0[lanes], radius_1[lanes], error[lanes];
  unsigned kinds;  ///< bits of the kinds that lanes have
};

void gather(const Quadric& from, double part, int lane, QuadricPacket& to);

/// All lanes; right are those of the mask it returns.
LaneMask compute_points(const QuadricPacket& quadrics, const RayHitPacket& hits, FacePacket& to);

}  // namespace tracer
