#include <algorithm>
#include <bit>
#include <utility>

#include "tracer/src/compile/compile_steps.h"
#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

template <class... Points>
std::uint64_t hash_of(const Points&... points) {
  std::uint64_t hash = 0;
  const auto add = [&](const Vec3& p) {
    for (const double value : {p.x, p.y, p.z}) hash = mix(hash ^ std::bit_cast<std::uint64_t>(value));
  };
  (add(points), ...);
  return hash;
}

/// Marks the elements that equal an earlier one; empty if none does. In a long list, only if a sample of its elements
/// has equal ones: few duplicates cost no time, and a search among millions would.
template <class Hash, class Equal>
std::vector<bool> duplicates_of(std::size_t count, const Hash& hash, const Equal& equal) {
  constexpr std::size_t long_list = std::size_t{1} << 12, sample = 16;
  std::vector<std::pair<std::uint64_t, std::size_t>> keys;
  const auto has_equal = [&](std::size_t step) {
    keys.clear();
    for (std::size_t i = 0; i < count; i += step) keys.emplace_back(hash(i), i);
    std::ranges::sort(keys);
    return std::ranges::adjacent_find(keys, {}, [](const auto& key) { return key.first; }) != keys.end();
  };
  if ((count > long_list && !has_equal(sample)) || !has_equal(1)) return {};
  std::vector<bool> marked(count);
  for (std::size_t i = 1, first = 0; i < count; ++i) {
    if (keys[i].first != keys[first].first) first = i;
    marked[keys[i].second] = i != first && equal(keys[first].second, keys[i].second);
  }
  return marked;
}

/// Erases the marked elements of lists, which may be empty. Returns their number.
template <class... Values>
std::uint64_t erase(const std::vector<bool>& marked, std::vector<Values>&... lists) {
  const auto shorten = [&](auto& list) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < list.size(); ++i)
      if (!marked[i] && kept++ != i) list[kept - 1] = std::move(list[i]);
    list.resize(kept);
  };
  const auto count = static_cast<std::uint64_t>(std::ranges::count(marked, true));
  if (count != 0) (shorten(lists), ...);
  return count;
}

std::uint64_t drop(SphereGeometry& s) {
  return erase(
      duplicates_of(
          s.x.size(),
          [&](std::size_t i) {
            return hash_of(s.center(i), Vec3{s.radius[i], 0, 0});
          },
          [&](std::size_t a, std::size_t b) { return s.center(a) == s.center(b) && s.radius[a] == s.radius[b]; }),
      s.x, s.y, s.z, s.radius, s.object);
}

std::uint64_t drop(QuadricGeometry& set) {
  const std::vector<Quadric>& all = set.quadrics;
  const auto hash = [&](std::size_t i) {
    const Linear& map = all[i].render_from_shape;
    return hash_of(all[i].origin, map.x, map.y, map.z);
  };
  return erase(duplicates_of(all.size(), hash, [&](std::size_t a, std::size_t b) { return all[a] == all[b]; }),
               set.quadrics, set.object);
}

std::uint64_t drop(PlaneGeometry& planes) {
  const auto equal = [&](std::size_t a, std::size_t b) {
    return planes.point[a] == planes.point[b] && planes.normal[a] == planes.normal[b] &&
           planes.transmissive[a] == planes.transmissive[b];
  };
  const auto hash = [&](std::size_t i) {
    return hash_of(planes.point[i], planes.normal[i], Vec3{static_cast<double>(planes.transmissive[i]), 0, 0});
  };
  return erase(duplicates_of(planes.point.size(), hash, equal), planes.point, planes.normal, planes.object,
               planes.transmissive);
}

std::uint64_t drop(TriangleGeometry& mesh) {
  const auto corner = [&](std::size_t i, std::size_t which) { return mesh.position(mesh.triangles[i][which]); };
  const auto equal = [&](std::size_t a, std::size_t b) {
    return corner(a, 0) == corner(b, 0) && corner(a, 1) == corner(b, 1) && corner(a, 2) == corner(b, 2);
  };
  const auto hash = [&](std::size_t i) { return hash_of(corner(i, 0), corner(i, 1), corner(i, 2)); };
  return erase(duplicates_of(mesh.triangles.size(), hash, equal), mesh.triangles, mesh.object_of_triangle,
               mesh.polygon_centers);
}

/// Whole meshes. Returns the number of their triangles.
std::uint64_t drop_meshes(std::vector<TriangleGeometry>& meshes) {
  const auto hash = [&](std::size_t i) {
    const std::vector<Vec3>& positions = meshes[i].positions;
    const Vec3 sizes{static_cast<double>(positions.size()), static_cast<double>(meshes[i].triangles.size()),
                     meshes[i].transmissive ? 1.0 : 0.0};
    return hash_of(sizes, positions.front(), positions[positions.size() / 2], positions.back());
  };
  const std::vector<bool> marked = duplicates_of(meshes.size(), hash, [&](std::size_t a, std::size_t b) {
    return meshes[a].transmissive == meshes[b].transmissive && meshes[a].triangles == meshes[b].triangles &&
           meshes[a].positions == meshes[b].positions;
  });
  std::uint64_t triangles = 0;
  for (std::size_t i = 0; i < marked.size(); ++i) triangles += marked[i] ? meshes[i].triangles.size() : 0;
  erase(marked, meshes);
  return triangles;
}

}  // namespace

void drop_duplicates(GeometrySet& geometry) {
  for (const TriangleGeometry& mesh : geometry.triangles) geometry.mesh_has_normals.push_back(!mesh.normals.empty());
  geometry.duplicates = drop_meshes(geometry.triangles) + drop(geometry.planes);
  for (SphereGeometry& spheres : geometry.spheres) geometry.duplicates += drop(spheres);
  for (TriangleGeometry& mesh : geometry.triangles) geometry.duplicates += drop(mesh);
  for (QuadricGeometry& quadrics : geometry.quadrics) geometry.duplicates += drop(quadrics);
}

}  // namespace tracer
