#pragma once
/// Where rays meet surfaces, sixteen at a time: the same bits as shape_hit's, for every kind of shape.

#include "tracer/src/accel/geometry.h"
#include "tracer/src/interaction/triangle_faces.h"

namespace tracer {

/// What sixteen rays met: all lanes hold a hit, though some may be of no use.
struct alignas(64) RayHitPacket {
  double on_x[lanes], on_y[lanes], on_z[lanes];  ///< where the ray's arithmetic has the hit
  double u[lanes], v[lanes];
  PrimitiveRef primitive[lanes];
};

/// Beside them: points and faces, whose they are, and how they are shaded.
struct alignas(64) PointPacket : FacePacket {
  std::uint32_t object[lanes];

  bool smooth;  ///< some normals are not their faces'; otherwise what follows means nothing
  double normal_x[lanes], normal_y[lanes], normal_z[lanes];  ///< unit shading normal, outward
  double offset_x[lanes], offset_y[lanes], offset_z[lanes];  ///< to where shadow rays start, seen from outside
};

void meet_points(const GeometrySet& geometry, const RayHitPacket& met, PointPacket& points);

}  // namespace tracer
