#pragma once
/// Surface points of 16 hits at a time, for every kind of shape; bit-identical to shape_hit().

#include "tracer/src/accel/geometry.h"
#include "tracer/src/interaction/triangle_faces.h"

namespace tracer {

/// Intersections of 16 rays. All lanes hold a hit.
struct alignas(64) RayHitPacket {
  double on_x[lanes], on_y[lanes], on_z[lanes];  ///< point on the ray at the distance of the hit
  double u[lanes], v[lanes];
  PrimitiveRef primitive[lanes];
};

/// Points on the surfaces, their objects and shading normals.
struct alignas(64) PointPacket : FacePacket {
  std::uint32_t object[lanes];

  bool smooth;  ///< some shading normals differ from the faces; else the members below are undefined
  double normal_x[lanes], normal_y[lanes], normal_z[lanes];  ///< unit shading normal, outward
  double offset_x[lanes], offset_y[lanes],
      offset_z[lanes];  ///< from the point to the origin of shadow rays, for front-face hits
};

void compute_points(const GeometrySet& geometry, const RayHitPacket& hits, PointPacket& points);

}  // namespace tracer
