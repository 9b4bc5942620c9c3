#pragma once
/// Surface points of 16 hits at a time, for every kind of shape; bit-identical to shape_hit().

#include "tracer/src/accel/geometry.h"
#include "tracer/src/math/lanes.h"

namespace tracer {

/// Intersections of 16 rays. All lanes hold a hit.
struct alignas(64) RayHitPacket {
  VecLanes on_ray;  ///< point on the ray at the distance of the hit
  double u[lanes], v[lanes];
  PrimitiveRef primitive[lanes];
};

/// Points with error bounds and unit geometric normals, outward.
struct alignas(64) FacePacket {
  VecLanes position, error, face;
};

/// Points on the surfaces, their objects and shading normals.
struct alignas(64) PointPacket : FacePacket {
  std::uint32_t object[lanes];

  bool smooth;      ///< some shading normals differ from the faces; else the members below are undefined
  VecLanes normal;  ///< unit shading normal, outward
  VecLanes offset;  ///< from the point to the origin of shadow rays, for front-face hits
};

void compute_points(const GeometrySet& geometry, const RayHitPacket& hits, PointPacket& points);

}  // namespace tracer
