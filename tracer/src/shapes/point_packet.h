#pragma once
/// Where rays meet surfaces, sixteen at a time: the same bits as shape_hit's, for every kind of shape.

#include "tracer/src/accel/geometry.h"
#include "tracer/src/math/wide.h"

namespace tracer {

/// What sixteen rays met: all lanes hold a hit, though some may be of no use.
struct alignas(64) MetPacket {
  double on_x[lanes], on_y[lanes], on_z[lanes];  ///< where the ray's arithmetic has the hit
  double u[lanes], v[lanes];
  PrimitiveRef primitive[lanes];
};

/// Beside them.
struct alignas(64) PointPacket {
  double x[lanes], y[lanes], z[lanes];
  double error_x[lanes], error_y[lanes], error_z[lanes];
  double face_x[lanes], face_y[lanes], face_z[lanes];  ///< unit geometric normal, outward
  std::uint32_t object[lanes];

  bool smooth;  ///< some normals are not their faces'; otherwise what follows means nothing
  double normal_x[lanes], normal_y[lanes], normal_z[lanes];  ///< unit shading normal, outward
  double offset_x[lanes], offset_y[lanes], offset_z[lanes];  ///< to where shadow rays start, seen from outside
};

void meet_points(const GeometrySet& geometry, const MetPacket& met, PointPacket& points);

}  // namespace tracer
