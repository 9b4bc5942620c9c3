#include "tracer/src/accel/geometry.h"

#include "tracer/src/shapes/shape_registry.h"

namespace tracer {
namespace {

template <class T>
std::uint64_t bytes_of(const std::vector<T>& values) {
  return values.capacity() * sizeof(T);
}

}  // namespace

std::uint64_t memory_bytes(const GeometrySet& set) {
  std::uint64_t bytes = 0;
  for (const SphereGeometry& s : set.spheres)
    bytes += bytes_of(s.x) + bytes_of(s.y) + bytes_of(s.z) + bytes_of(s.radius) + bytes_of(s.object);
  for (const QuadricGeometry& q : set.quadrics) bytes += bytes_of(q.quadrics) + bytes_of(q.object);
  for (const TriangleGeometry& t : set.triangles)
    bytes += bytes_of(t.positions) + bytes_of(t.triangles) + bytes_of(t.normals) + bytes_of(t.uvs) +
             bytes_of(t.object_of_triangle);
  return bytes;
}

std::uint64_t max_transmissive_hits(const GeometrySet& set) {
  constexpr std::uint64_t convex = StandardShape::max_hits;
  std::uint64_t hits = 0;
  for (const SphereGeometry& g : set.spheres) hits += g.transmissive ? convex * g.x.size() : 0;
  for (const TriangleGeometry& g : set.triangles) hits += g.transmissive ? convex * g.triangles.size() : 0;
  for (const QuadricGeometry& g : set.quadrics)
    for (std::size_t i = 0; g.transmissive && i < g.quadrics.size(); ++i)
      visit_kind(g.quadrics[i].kind, [&](auto standard) { hits += standard.max_hits; });
  for (const std::uint8_t transmissive : set.planes.transmissive) hits += convex * transmissive;
  return 2 * hits;
}

}  // namespace tracer
