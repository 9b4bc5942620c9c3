#include "tracer/src/accel/geometry.h"

#include <cstddef>
#include <cstring>
#include <functional>
#include <string_view>

namespace tracer {
namespace {

/// Bindings name every field, so that one more does not compile until it is among them.
template <class Visit>
class Arrays {
 public:
  explicit Arrays(const Visit& visit) : visit_(visit) {}

  void operator()(const GeometrySet& set) const {
    const auto& [spheres, triangles, quadrics, planes] = set;
    each(spheres);
    each(triangles);
    each(quadrics);
    (*this)(planes);
  }

 private:
  template <class Geometry>
  void each(const std::vector<Geometry>& geometries) const {
    for (const Geometry& geometry : geometries) (*this)(geometry);
  }
  void operator()(const SphereGeometry& geometry) const {
    const auto& [x, y, z, radius, object, transmissive] = geometry;
    all(x, y, z, radius, object);
    scalar(transmissive);
  }
  void operator()(const TriangleGeometry& geometry) const {
    const auto& [positions, triangles, normals, uvs, object_of_triangle, object, transmissive] = geometry;
    all(positions, triangles, normals, uvs, object_of_triangle);
    scalar(object);
    scalar(transmissive);
  }
  void operator()(const QuadricGeometry& geometry) const {
    const auto& [quadrics, object, transmissive] = geometry;
    // Up to its last field: the padding behind that may hold anything.
    for (const Quadric& quadric : quadrics) visit_(&quadric, offsetof(Quadric, caps) + sizeof quadric.caps);
    all(object);
    scalar(transmissive);
  }
  void operator()(const PlaneGeometry& geometry) const {
    const auto& [point, normal, object, transmissive] = geometry;
    all(point, normal, object, transmissive);
  }

  template <class... Values>
  void all(const std::vector<Values>&... arrays) const {
    (array(arrays), ...);
  }
  template <class Value>
  void array(const std::vector<Value>& values) const {
    visit_(values.data(), values.size() * sizeof(Value));
  }
  template <class Value>
  void scalar(const Value& value) const {
    visit_(&value, sizeof value);
  }

  const Visit& visit_;
};

static_assert(sizeof(Vec3) == 3 * sizeof(double));
static_assert(offsetof(Quadric, kind) == sizeof(Vec3) + 2 * sizeof(Linear) + 2 * sizeof(double));
static_assert(offsetof(Quadric, caps) == offsetof(Quadric, kind) + sizeof(QuadricKind));

/// Calls visit(address, bytes) for all that is in the set: sets of as many geometries that are equal piece by piece are
/// equal. Every bit counts, 0 and -0 are not the same.
template <class Visit>
void for_each_array(const GeometrySet& set, const Visit& visit) {
  Arrays<Visit>{visit}(set);
}

struct Bytes {
  const void* first;
  std::size_t count;
};

template <class T>
std::uint64_t bytes_of(const std::vector<T>& values) {
  return values.capacity() * sizeof(T);
}

}  // namespace

std::size_t hash_of(const GeometrySet& set) {
  std::size_t hash = 0;
  for_each_array(set, [&](const void* first, std::size_t count) {
    const std::string_view bytes(static_cast<const char*>(first), count);
    hash = hash * 31 + std::hash<std::string_view>{}(bytes);
  });
  return hash;
}

bool same_bits(const GeometrySet& a, const GeometrySet& b) {
  if (a.spheres.size() != b.spheres.size() || a.triangles.size() != b.triangles.size() ||
      a.quadrics.size() != b.quadrics.size())
    return false;
  std::vector<Bytes> of_a;
  for_each_array(a, [&](const void* first, std::size_t count) { of_a.push_back({first, count}); });
  std::size_t next = 0;
  bool same = true;
  for_each_array(b, [&](const void* first, std::size_t count) {
    same = same && next < of_a.size() && of_a[next].count == count &&
           (count == 0 || std::memcmp(of_a[next].first, first, count) == 0);
    ++next;
  });
  return same && next == of_a.size();
}

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

std::uint64_t crossings_max(const GeometrySet& set) {
  std::uint64_t primitives = 0;
  for (const SphereGeometry& s : set.spheres) primitives += s.transmissive ? s.x.size() : 0;
  for (const TriangleGeometry& t : set.triangles) primitives += t.transmissive ? t.triangles.size() : 0;
  for (const QuadricGeometry& q : set.quadrics) primitives += q.transmissive ? q.quadrics.size() : 0;
  for (const std::uint8_t transmissive : set.planes.transmissive) primitives += transmissive;
  return 4 * primitives;
}

}  // namespace tracer
