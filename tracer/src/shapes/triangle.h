#pragma once
/// Planes, triangles and meshes: validation beyond the ranges of their fields, and extents.

#include "tracer/src/math/bounds.h"

namespace tracer {

inline double reach(const Plane& p) { return largest_component(p.point); }
inline double reach(const Triangle& t) {
  return std::max(
      {largest_component(t.vertices[0]), largest_component(t.vertices[1]), largest_component(t.vertices[2])});
}
inline double reach(const Mesh& mesh) {
  double reach = 0;
  for (const Vec3& position : mesh.positions) reach = std::max(reach, largest_component(position));
  return reach;
}
inline double reach(const Instance&) { return 0; }

template <class Checks>
void check(Checks& checks, const Plane& plane) {
  checks.not_parallel("u_axis", plane.u_axis, plane.normal, "must not be parallel to the normal");
}

template <class Checks>
void check(Checks& checks, const Triangle& triangle) {
  const auto& [a, b, c] = triangle.vertices;
  checks.has_area("vertices", a, b - a, c - a, "the three vertices are on one line: the triangle has no area");
}

}  // namespace tracer
