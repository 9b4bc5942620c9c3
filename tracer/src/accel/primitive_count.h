#pragma once
/// Number of the primitives of a geometry.

#include "tracer/src/accel/accelerator.h"

namespace tracer {

inline std::size_t primitive_count(const GeometrySet& set, std::uint32_t geometry) {
  const GeometryKind kind = set.kind_of(geometry);
  return kind == GeometryKind::spheres     ? set.spheres[geometry].x.size()
         : kind == GeometryKind::triangles ? set.mesh(geometry).triangles.size()
         : kind == GeometryKind::quadrics  ? set.quadric_set(geometry).quadrics.size()
                                           : set.planes.point.size();
}

}  // namespace tracer
