// Validates shapes, prototypes and instances: values, references, cycles, and totals after instancing.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <variant>

#include "tracer/src/scene/checks.h"
#include "tracer/src/scene/instancing.h"
#include "tracer/src/shapes/shape_registry.h"

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
void check_shape(Checks&, const DocumentPath&, const Instance&) {}

bool check_transform(Checks& checks, const DocumentPath& object, const Transform& transform) {
  const DocumentPath where(object, "transform");
  bool all_well = true;
  for (const auto& row : transform.rows)
    for (const double entry : row) all_well = all_well && checks.coordinate(where, entry);
  if (all_well && is_singular(affine(transform).linear))
    return checks.add_issue(where, "degenerate", "is singular: it flattens space, and there is no way back");
  return all_well;
}

/// The path of a list's object, which is the list's own for parts of one object (Prototype::is_one_object).
DocumentPath object_path(const DocumentPath& list, std::size_t index, bool are_parts) {
  return are_parts ? list : DocumentPath(list, index);
}

/// Checks the shapes, materials and transforms of one list. Returns false if a transform is invalid, so that the
/// transformed objects cannot be checked.
bool check_object_list(Checks& checks, const Scene& scene, const DocumentPath& where,
                       const std::vector<Object>& objects, bool are_parts) {
  bool transforms_well = true;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const DocumentPath place = object_path(where, i, are_parts);
    const Object& object = objects[i];
    std::visit([&](const auto& any) { check_shape(checks, place, any); }, object.shape);
    if (const auto* mesh = std::get_if<Mesh>(&object.shape)) {
      const DocumentPath materials(place, "materials");
      if (mesh->file) checks.reference({place, "file"}, "asset", mesh->file->index, scene.assets.size());
      for (const auto& [name, id] : mesh->part_materials)
        checks.reference({materials, name}, "material", id.index, scene.materials.size());
    }
    if (object.transform) transforms_well &= check_transform(checks, place, *object.transform);
    const auto* instance = std::get_if<Instance>(&object.shape);
    const std::optional<MaterialId> material = instance != nullptr ? instance->material : object.material;
    if (material) checks.reference({place, "material"}, "material", material->index, scene.materials.size());
  }
  return transforms_well;
}

/// Totals of a list of objects. Doubles, so that nested instances cannot overflow a count.
struct Extent {
  double objects = 0, triangles = 0;
  double reach = 0;         ///< upper bound of the coordinates
  double shrink = 1;        ///< lower bound of the scaling of lengths
  double condition = 1;     ///< upper bound of the condition numbers of the products of transforms
  std::uint32_t depth = 0;  ///< nesting of instances
};

double norm(const Linear& m) {  // maximum norm: the largest row sum
  return std::max({std::abs(m.x.x) + std::abs(m.y.x) + std::abs(m.z.x),
                   std::abs(m.x.y) + std::abs(m.y.y) + std::abs(m.z.y),
                   std::abs(m.x.z) + std::abs(m.y.z) + std::abs(m.z.z)});
}

double frobenius(const Linear& m) { return std::hypot(length(m.x), length(m.y), length(m.z)); }

/// True if the product of the transforms of a shape is singular.
bool flattens(const Scene& scene, const Object& object, const Linear& world_from_group) {
  const Linear m = object.transform ? world_from_group * affine(*object.transform).linear : world_from_group;
  if (is_singular(m)) return true;
  const auto* instance = std::get_if<Instance>(&object.shape);
  if (instance == nullptr) return false;
  const std::vector<Object>& placed = scene.prototypes[instance->of.index].objects;
  return std::ranges::any_of(placed, [&](const Object& inner) { return flattens(scene, inner, m); });
}

class Counting {
 public:
  Counting(Checks& checks, const Scene& scene)
      : checks_(checks), scene_(scene), extents_(scene.prototypes.size()), states_(scene.prototypes.size()) {}

  /// False after an invalid reference, a cycle or too deep nesting was reported.
  bool count(const std::vector<Object>& objects, const DocumentPath& where, bool are_parts, std::uint32_t depth,
             Extent& total) {
    bool all_well = true;
    for (std::size_t i = 0; i < objects.size(); ++i) {
      Extent part;
      const auto* instance = std::get_if<Instance>(&objects[i].shape);
      if (instance != nullptr) {
        const DocumentPath place = object_path(where, i, are_parts);
        if (!count_prototype(instance->of.index, {place, "of"}, depth + 1, part)) {
          all_well = false;
          continue;
        }
        part.depth += 1;
      } else {
        part = own_extent(objects[i].shape);
      }
      add(objects[i], part, total);
    }
    return all_well;
  }

  /// Checks unused prototypes too: a cycle is an error everywhere.
  bool count_prototypes() {
    bool all_well = true;
    for (std::uint32_t index = 0; index < extents_.size(); ++index) {
      Extent unused;
      all_well &= count_prototype(index, DocumentPath(scene_.prototypes[index].path), 0, unused);
    }
    return all_well;
  }

 private:
  enum class State : std::uint8_t { unseen, open, counted, bad };

  /// Coordinates beyond the limit before any transform have been reported with their shape.
  [[nodiscard]] Extent own_extent(const Shape& shape) const {
    const auto* mesh = std::get_if<Mesh>(&shape);
    const bool triangle = std::holds_alternative<Triangle>(shape);
    return {.objects = 1,
            .triangles = mesh != nullptr ? static_cast<double>(mesh->triangles.size()) : (triangle ? 1.0 : 0.0),
            .reach = std::min(std::visit([](const auto& any) { return tracer::reach(any); }, shape),
                              checks_.limits.coordinate_max)};
  }

  static void add(const Object& object, Extent part, Extent& total) {
    if (object.transform) {
      const Affine a = affine(*object.transform);
      part.reach = part.reach * norm(a.linear) + largest_component(a.offset);
      part.shrink *= std::min({length(a.linear.x), length(a.linear.y), length(a.linear.z)});
      part.condition *= frobenius(a.linear) * frobenius(inverse(a.linear));
    }
    total.objects += part.objects;
    total.triangles += part.triangles;
    total.reach = std::max(total.reach, part.reach);
    total.shrink = std::min(total.shrink, part.shrink);
    total.condition = std::max(total.condition, part.condition);
    total.depth = std::max(total.depth, part.depth);
  }

  bool count_prototype(std::uint32_t index, const DocumentPath& of, std::uint32_t depth, Extent& extent) {
    if (!checks_.reference(of, "prototype", index, extents_.size())) return false;
    if (states_[index] == State::open)
      return checks_.add_issue(of, "circular_reference", "the prototype holds itself: instances go round in a circle");
    if (states_[index] == State::bad) return false;
    // Checked before the recursion, so its depth is at most the limit.
    if (depth + extents_[index].depth > checks_.limits.instance_depth)
      return checks_.over(of, "instance_depth", std::to_string(checks_.limits.instance_depth), "more");
    if (states_[index] == State::unseen) {
      states_[index] = State::open;
      const Prototype& prototype = scene_.prototypes[index];
      const DocumentPath where(prototype.path);
      const bool well = count(prototype.objects, where, prototype.is_one_object, depth, extents_[index]);
      states_[index] = well ? State::counted : State::bad;
      if (!well) return false;
    }
    extent = extents_[index];
    return true;
  }

  Checks& checks_;
  const Scene& scene_;
  std::vector<Extent> extents_;
  std::vector<State> states_;
};

}  // namespace

void check_objects(Checks& checks, const Scene& scene) {
  const DocumentPath objects("/objects");
  bool transforms_well = check_object_list(checks, scene, objects, scene.objects, false);
  for (const Prototype& prototype : scene.prototypes)
    transforms_well &=
        check_object_list(checks, scene, DocumentPath(prototype.path), prototype.objects, prototype.is_one_object);

  Extent total;
  Counting counting(checks, scene);
  const bool objects_well = counting.count(scene.objects, objects, false, 0, total);
  if (!counting.count_prototypes() || !objects_well || !transforms_well) return;
  const auto saturated = [](double count) {
    return count < 1e18 ? static_cast<std::uint64_t>(count) : std::numeric_limits<std::uint64_t>::max();
  };
  const bool few = checks.count(objects, saturated(total.objects), checks.limits.objects, "objects");
  checks.count(objects, saturated(total.triangles), checks.limits.triangles, "triangles");
  // Shapes within the limits may exceed them when transformed. NaN has been reported above.
  if (total.reach > checks.limits.coordinate_max)
    checks.over(objects, "coordinate_max", text_of(checks.limits.coordinate_max),
                text_of(total.reach) + " with the transforms applied");
  if (total.shrink < checks.limits.length_min)
    checks.over(objects, "length_min", text_of(checks.limits.length_min),
                text_of(total.shrink) + " with the transforms applied");
  // Columns of a product span at least the inverse square of its condition number, which is at most the product of the
  // factors': placements are checked one by one only above that bound. (NaN: an inverse overflowed.)
  if (!few || total.condition <= 0x1p24) return;
  for (std::size_t i = 0; i < scene.objects.size(); ++i)
    if (std::holds_alternative<Instance>(scene.objects[i].shape) && flattens(scene, scene.objects[i], {}))
      checks.add_issue(
          {objects, i}, "degenerate",
          "its transform is singular together with one that it places: they flatten space, and there is no way "
          "back");
}

}  // namespace tracer
