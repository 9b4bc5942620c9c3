/// What shapes must be: finite, not degenerate, and pointing at things that exist.

#include <cstdint>
#include <string>
#include <variant>

#include "tracer/src/scene/checks.h"
#include "tracer/src/scene/instancing.h"

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

void check_u_axis(Checks& checks, const Where& object, const std::optional<Vec3>& u_axis, const Vec3& axis,
                  bool axis_is_well, std::string_view name) {
  if (u_axis && checks.direction({object, "u_axis"}, *u_axis) && axis_is_well && parallel(axis, *u_axis)) {
    checks.tell({object, "u_axis"}, "degenerate", "must not be parallel to the " + std::string(name));
  }
}

void check_shape(Checks& checks, const Where& object, const Plane& plane) {
  checks.position({object, "point"}, plane.point);
  const bool normal = checks.direction({object, "normal"}, plane.normal);
  check_u_axis(checks, object, plane.u_axis, plane.normal, normal, "normal");
}

void check_shape(Checks& checks, const Where& object, const Disc& disc) {
  checks.position({object, "center"}, disc.center);
  const bool normal = checks.direction({object, "normal"}, disc.normal);
  const bool radius = checks.length({object, "radius"}, disc.radius);
  const Where inner(object, "inner_radius");
  if (checks.coordinate(inner, disc.inner_radius)) {
    if (disc.inner_radius < 0) {
      checks.tell(inner, "out_of_range", "must be >= 0, got " + text_of(disc.inner_radius));
    } else if (radius && disc.inner_radius >= disc.radius) {
      checks.tell(inner, "out_of_range",
                  "must be < the radius " + text_of(disc.radius) + ", got " + text_of(disc.inner_radius));
    }
  }
  check_u_axis(checks, object, disc.u_axis, disc.normal, normal, "normal");
}

/// The axis between two ends; false when there is none.
bool check_axis(Checks& checks, const Where& from, const Vec3& start, const Where& to, const Vec3& end,
                const char* sentence) {
  const bool starts = checks.position(from, start);
  const bool ends = checks.position(to, end);
  if (!starts || !ends) return false;
  if (largest_component(difference(end, start)) >= checks.limits.length_min) return true;
  return checks.tell(to, "degenerate", sentence);
}

void check_shape(Checks& checks, const Where& object, const Cylinder& cylinder) {
  const bool axis = check_axis(checks, {object, "from"}, cylinder.from, {object, "to"}, cylinder.to,
                               "must not be where `from` is: the cylinder has no length");
  checks.length({object, "radius"}, cylinder.radius);
  check_u_axis(checks, object, cylinder.u_axis, difference(cylinder.to, cylinder.from), axis, "axis");
}

void check_shape(Checks& checks, const Where& object, const Cone& cone) {
  const bool axis = check_axis(checks, {object, "base"}, cone.base, {object, "apex"}, cone.apex,
                               "must not be where the base is: the cone has no height");
  const Where apex_radius(object, "apex_radius");
  checks.length({object, "radius"}, cone.radius);
  if (checks.coordinate(apex_radius, cone.apex_radius) && cone.apex_radius < 0) {
    checks.tell(apex_radius, "out_of_range", "must be >= 0, got " + text_of(cone.apex_radius));
  }
  check_u_axis(checks, object, cone.u_axis, difference(cone.apex, cone.base), axis, "axis");
}

void check_shape(Checks& checks, const Where& object, const Box& box) {
  const bool min = checks.position({object, "min"}, box.min);
  const bool max = checks.position({object, "max"}, box.max);
  if (!min || !max) return;
  const Vec3 size = difference(box.max, box.min);
  const double least = std::min({size.x, size.y, size.z});
  if (least < checks.limits.length_min) {
    checks.tell({object, "max"}, "degenerate", "every coordinate must be greater than that of `min`");
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
  if (mesh.file) return;  // what is in it is not known yet
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

/// Where it leads is checked with all prototypes at once.
void check_shape(Checks& checks, const Where& object, const Instance& instance) {
  (void)checks, (void)object, (void)instance;
}

bool check_transform(Checks& checks, const Where& object, const Transform& transform) {
  const Where where(object, "transform");
  bool all_well = true;
  for (const auto& row : transform.rows)
    for (const double entry : row) all_well = all_well && checks.coordinate(where, entry);
  if (all_well && is_singular(affine(transform).linear))
    return checks.tell(where, "degenerate", "is singular: it flattens space, and there is no way back");
  return all_well;
}

}  // namespace

bool check_object_list(Checks& checks, const Scene& scene, const Where& where, const std::vector<Object>& objects) {
  bool transforms_well = true;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const Where place(where, i);
    const Object& object = objects[i];
    std::visit([&](const auto& any) { check_shape(checks, place, any); }, object.shape);
    const auto* mesh = std::get_if<Mesh>(&object.shape);
    if (mesh != nullptr && mesh->file && mesh->file->index >= scene.assets.size()) {
      checks.tell({place, "file"}, "unknown_reference", "there is no asset " + std::to_string(mesh->file->index));
    }
    if (object.transform) transforms_well &= check_transform(checks, place, *object.transform);
    const auto* instance = std::get_if<Instance>(&object.shape);
    const std::optional<MaterialId> material = instance != nullptr ? instance->material : object.material;
    if (material && material->index >= scene.materials.size()) {
      checks.tell({place, "material"}, "unknown_reference", "there is no material " + std::to_string(material->index));
    }
  }
  return transforms_well;
}

}  // namespace tracer
