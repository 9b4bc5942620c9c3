/// What shapes must be: finite, not degenerate, and pointing at things that exist.

#include <cstdint>
#include <string>
#include <variant>

#include "tracer/src/scene/checks.h"

namespace tracer {
namespace {

void check_shape(Checks& checks, const Where& object, const Sphere& sphere) {
  checks.position({object, "center"}, sphere.center);
  checks.length({object, "radius"}, sphere.radius);
  const bool axis = checks.direction({object, "axis"}, sphere.axis);
  const bool meridian = checks.direction({object, "meridian"}, sphere.meridian);
  if (axis && meridian && parallel(sphere.axis, sphere.meridian)) {
    checks.tell({object, "meridian"}, "degenerate", "must not be parallel to the axis: phi = 0 would be nowhere");
  }
}

void check_shape(Checks& checks, const Where& object, const Plane& plane) {
  checks.position({object, "point"}, plane.point);
  const bool normal = checks.direction({object, "normal"}, plane.normal);
  if (plane.u_axis && checks.direction({object, "u_axis"}, *plane.u_axis) && normal &&
      parallel(plane.normal, *plane.u_axis)) {
    checks.tell({object, "u_axis"}, "degenerate", "must not be parallel to the normal");
  }
}

/// Precondition: the corners are coordinates.
bool has_area(const std::array<Vec3, 3>& corners, const Limits& limits) {
  const Vec3 edges[2] = {difference(corners[1], corners[0]), difference(corners[2], corners[0])};
  for (const Vec3& edge : edges) {
    const bool long_enough =
        edge.x * edge.x + edge.y * edge.y + edge.z * edge.z >= limits.length_min * limits.length_min;
    if (!long_enough) return false;
  }
  return !parallel(edges[0], edges[1]);
}

void check_shape(Checks& checks, const Where& object, const Triangle& triangle) {
  const Where vertices(object, "vertices");
  bool all_well = true;
  for (std::size_t i = 0; i < 3; ++i) all_well &= checks.position({vertices, i}, triangle.vertices[i]);
  if (all_well && !has_area(triangle.vertices, checks.limits)) {
    checks.tell(vertices, "degenerate", "the three vertices are on one line: the triangle has no area");
  }
  const Where normals(object, "normals");
  const Where uvs(object, "uvs");
  for (std::size_t i = 0; i < 3; ++i) {
    if (triangle.normals) checks.direction({normals, i}, (*triangle.normals)[i]);
    if (triangle.uvs) checks.vec2({uvs, i}, (*triangle.uvs)[i]);
  }
}

void check_indices(Checks& checks, const Where& triangles, const Mesh& mesh) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::uint32_t index = mesh.triangles[t][corner];
      if (index < mesh.positions.size()) continue;
      checks.tell({Where(triangles, t), corner}, "out_of_range",
                  "must be the index of one of the " + std::to_string(mesh.positions.size()) + " positions, got " +
                      std::to_string(index));
    }
  }
}

template <class Attribute>
void check_per_position(Checks& checks, const Where& where, const std::vector<Attribute>& values, const Mesh& mesh) {
  if (values.empty() || values.size() == mesh.positions.size()) return;
  checks.tell(where, "wrong_length",
              "must have one entry for each of the " + std::to_string(mesh.positions.size()) + " positions, has " +
                  std::to_string(values.size()));
}

/// Triangles without area are allowed: meshes of the real world have them, and no ray meets them.
void check_shape(Checks& checks, const Where& object, const Mesh& mesh) {
  const Where positions(object, "positions");
  const Where normals(object, "normals");
  const Where uvs(object, "uvs");
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) checks.position({positions, i}, mesh.positions[i]);
  check_indices(checks, {object, "triangles"}, mesh);
  check_per_position(checks, normals, mesh.normals, mesh);
  for (std::size_t i = 0; i < mesh.normals.size(); ++i) checks.direction({normals, i}, mesh.normals[i]);
  check_per_position(checks, uvs, mesh.uvs, mesh);
  for (std::size_t i = 0; i < mesh.uvs.size(); ++i) checks.vec2({uvs, i}, mesh.uvs[i]);
  if (mesh.triangles.empty()) checks.tell(object, "degenerate", "the mesh has no triangles");
}

}  // namespace

void check_objects(Checks& checks, const Scene& scene) {
  const Where objects("/objects");
  checks.count(objects, scene.objects.size(), checks.limits.objects, "objects");
  std::uint64_t triangles = 0;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Where object(objects, i);
    const Shape& shape = scene.objects[i].shape;
    std::visit([&](const auto& any) { check_shape(checks, object, any); }, shape);
    if (const auto* mesh = std::get_if<Mesh>(&shape)) triangles += mesh->triangles.size();
    if (std::holds_alternative<Triangle>(shape)) ++triangles;
    if (scene.objects[i].material.index >= scene.materials.size()) {
      checks.tell({object, "material"}, "unknown_reference",
                  "there is no material " + std::to_string(scene.objects[i].material.index));
    }
  }
  checks.count(objects, triangles, checks.limits.triangles, "triangles");
}

}  // namespace tracer
