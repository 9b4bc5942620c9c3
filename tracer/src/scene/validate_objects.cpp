/// Validates shapes: finite, not degenerate, with valid references.

#include <cstdint>
#include <string>
#include <variant>

#include "tracer/src/scene/checks.h"
#include "tracer/src/scene/instancing.h"
#include "tracer/src/shapes/registry.h"
#include "tracer/src/shapes/triangle.h"

namespace tracer {
namespace {

template <HasFields S>
void check_shape(Checks& checks, const DocumentPath& object, const S& shape) {
  FieldChecks fields(checks, object);
  fields.ranges(shape);
  check(fields, shape);
}

void check_indices(Checks& checks, const DocumentPath& triangles, const Mesh& mesh) {
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::uint32_t index = mesh.triangles[t][corner];
      if (index < mesh.positions.size()) continue;
      checks.add_issue({DocumentPath(triangles, t), corner}, "out_of_range",
                       "must be the index of one of the " + std::to_string(mesh.positions.size()) + " positions, got " +
                           std::to_string(index));
    }
  }
}

template <class Attribute>
void check_per_position(Checks& checks, const DocumentPath& where, const std::vector<Attribute>& values,
                        const Mesh& mesh) {
  if (values.empty() || values.size() == mesh.positions.size()) return;
  checks.add_issue(where, "wrong_length",
                   "must have one entry for each of the " + std::to_string(mesh.positions.size()) + " positions, has " +
                       std::to_string(values.size()));
}

/// Degenerate triangles are valid: many mesh files contain them, and no ray intersects them.
void check_shape(Checks& checks, const DocumentPath& object, const Mesh& mesh) {
  if (mesh.file) return;  // not read yet
  const DocumentPath positions(object, "positions");
  const DocumentPath normals(object, "normals");
  const DocumentPath uvs(object, "uvs");
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) checks.position({positions, i}, mesh.positions[i]);
  check_indices(checks, {object, "triangles"}, mesh);
  check_per_position(checks, normals, mesh.normals, mesh);
  for (std::size_t i = 0; i < mesh.normals.size(); ++i) checks.direction({normals, i}, mesh.normals[i]);
  check_per_position(checks, uvs, mesh.uvs, mesh);
  for (std::size_t i = 0; i < mesh.uvs.size(); ++i) checks.vec2({uvs, i}, mesh.uvs[i]);
  if (mesh.triangles.empty()) checks.add_issue(object, "degenerate", "the mesh has no triangles");
}

/// The reference is checked with all prototypes at once.
void check_shape(Checks& checks, const DocumentPath& object, const Instance& instance) {
  (void)checks, (void)object, (void)instance;
}

bool check_transform(Checks& checks, const DocumentPath& object, const Transform& transform) {
  const DocumentPath where(object, "transform");
  bool all_well = true;
  for (const auto& row : transform.rows)
    for (const double entry : row) all_well = all_well && checks.coordinate(where, entry);
  if (all_well && is_singular(affine(transform).linear))
    return checks.add_issue(where, "degenerate", "is singular: it flattens space, and there is no way back");
  return all_well;
}

}  // namespace

bool check_object_list(Checks& checks, const Scene& scene, const DocumentPath& where,
                       const std::vector<Object>& objects) {
  bool transforms_well = true;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const DocumentPath place(where, i);
    const Object& object = objects[i];
    std::visit([&](const auto& any) { check_shape(checks, place, any); }, object.shape);
    const auto* mesh = std::get_if<Mesh>(&object.shape);
    if (mesh != nullptr && mesh->file && mesh->file->index >= scene.assets.size()) {
      checks.add_issue({place, "file"}, "unknown_reference", "there is no asset " + std::to_string(mesh->file->index));
    }
    if (object.transform) transforms_well &= check_transform(checks, place, *object.transform);
    const auto* instance = std::get_if<Instance>(&object.shape);
    const std::optional<MaterialId> material = instance != nullptr ? instance->material : object.material;
    if (material && material->index >= scene.materials.size()) {
      checks.add_issue({place, "material"}, "unknown_reference",
                       "there is no material " + std::to_string(material->index));
    }
  }
  return transforms_well;
}

}  // namespace tracer
