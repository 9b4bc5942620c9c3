#include "tracer/src/scene/medium_boundary.h"

#include <bit>
#include <vector>

#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

std::uint64_t hash_of(const Vec3& position) {
  std::uint64_t hash = 0;
  for (const double coordinate : {position.x, position.y, position.z})
    hash = mix(hash ^ std::bit_cast<std::uint64_t>(coordinate + 0.0));  // -0 equals 0
  return hash;
}

/// The sum over all edges of a hash that changes its sign with the direction of the edge: 0 if all edges cancel. Others
/// are 0 with a probability of 2^-64.
bool is_closed(const Mesh& mesh) {
  std::vector<std::uint64_t> corner;
  corner.reserve(mesh.positions.size());
  for (const Vec3& position : mesh.positions) corner.push_back(hash_of(position));
  std::uint64_t sum = 0;
  const auto add_edge = [&](std::uint64_t from, std::uint64_t to) { sum += mix(mix(from) ^ to) - mix(mix(to) ^ from); };
  for (const auto& [a, b, c] : mesh.triangles) {
    add_edge(corner[a], corner[b]);
    add_edge(corner[b], corner[c]);
    add_edge(corner[c], corner[a]);
  }
  return sum == 0;
}

struct IsClosed {
  bool operator()(const Mesh& mesh) const { return is_closed(mesh); }
  bool operator()(const Cylinder& cylinder) const { return cylinder.caps; }
  bool operator()(const Cone& cone) const { return cone.caps; }
  bool operator()(const Disc&) const { return false; }
  bool operator()(const Triangle&) const { return false; }
  template <class Solid>
  bool operator()(const Solid&) const {
    return true;
  }
};

}  // namespace

MediumBoundary medium_boundary(const Shape& shape, const Material& material) {
  const bool refracts = material.transparency == Material::Transparency::refract;
  const bool absorbs = !(material.absorption == Color{});
  if (!(material.transmission > 0) || !(refracts || absorbs)) return MediumBoundary::none;
  if (std::visit(IsClosed{}, shape)) return MediumBoundary::closed;
  return refracts && (absorbs || material.ior != 1) ? MediumBoundary::open : MediumBoundary::none;
}

}  // namespace tracer
