#pragma once
/// Objects after instancing, with their transforms to world space.

#include <cstddef>
#include <string>
#include <string_view>

#include "tracer/src/math/affine.h"

namespace tracer {

inline Affine affine(const Transform& t) {
  const auto& r = t.rows;
  return {{{r[0][0], r[1][0], r[2][0]}, {r[0][1], r[1][1], r[2][1]}, {r[0][2], r[1][2], r[2][2]}},
          {r[0][3], r[1][3], r[2][3]}};
}

/// One placement of an object of the scene or of a prototype.
struct Placed {
  const Shape& shape;  ///< never an Instance
  MaterialId material;
  Affine world_from_object;  ///< exactly the identity without transforms
  bool shadow;               ///< false if the object or an instance around it has none
  std::string_view group;    ///< JSON pointer of its list: "/objects", or its prototype
  bool is_part;              ///< the list is one object of the document, at `group`
  std::size_t index;         ///< index in that list
};

/// JSON pointer of the object in the document.
inline std::string pointer(const Placed& placed) {
  return std::string(placed.group) + (placed.is_part ? std::string() : "/" + std::to_string(placed.index));
}

/// Calls visit(Placed) for every object, prototypes' objects once per instance, in document order. The depth of
/// recursion is that of the instances. Precondition: handles are valid and prototypes have no cycle.
template <class Visit>
void for_each_placed(const Scene& scene, const std::vector<Object>& objects, std::string_view group, bool are_parts,
                     const Affine& world_from_group, const std::optional<MaterialId>& material, bool shadow,
                     const Visit& visit) {
  for (const Object& object : objects) {
    const Affine world_from_object = object.transform ? world_from_group * affine(*object.transform) : world_from_group;
    if (const auto* instance = std::get_if<Instance>(&object.shape)) {
      const Prototype& prototype = scene.prototypes[instance->of.index];
      for_each_placed(scene, prototype.objects, prototype.path, prototype.is_one_object, world_from_object,
                      material ? material : instance->material, shadow && object.shadow, visit);
    } else {
      visit(Placed{object.shape, material.value_or(object.material), world_from_object, shadow && object.shadow, group,
                   are_parts, static_cast<std::size_t>(&object - objects.data())});
    }
  }
}

template <class Visit>
void for_each_placed(const Scene& scene, const Visit& visit) {
  for_each_placed(scene, scene.objects, "/objects", false, Affine{}, std::nullopt, true, visit);
}

}  // namespace tracer
