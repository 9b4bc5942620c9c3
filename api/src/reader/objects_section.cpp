#include <cstdint>
#include <vector>

#include "api/src/reader/fields.h"
#include "api/src/reader/references.h"
#include "api/src/reader/sections.h"
#include "api/src/reader/variants.h"

namespace api {
namespace {

constexpr auto object_types = type_words(static_cast<const tracer::Shape*>(nullptr));

/// Alternatives with fields of their own kind are below.
template <tracer::HasFields Shape>
void read_shape(Reading& /*reading*/, Fields& fields, Shape& shape) {
  read_all_fields(fields, shape);
}

void read_shape(Reading& /*reading*/, Fields& fields, tracer::Sphere& sphere) {
  read_all_fields(fields, sphere);
  // The default +x of the meridian is the pole then; z as for every other first axis.
  if (!fields.has("meridian") && sphere.axis.y == 0 && sphere.axis.z == 0) sphere.meridian = {0, 0, 1};
}

/// `of` names a prototype, whether it stands before or after this.
void read_shape(Reading& reading, Fields& fields, tracer::Instance& instance) {
  if (const auto of = fields.take("of")) {
    instance.of = read_prototype_reference(reading, *of);
  } else {
    fields.report_missing_field("of");
  }
  if (const auto material = fields.take("material")) instance.material = read_material_reference(reading, *material);
}

void read_object(Reading& reading, const Cursor& at, std::vector<tracer::Object>& objects) {
  // Kept even when it is bad, so that the next ones have the document's index.
  tracer::Object& object = objects.emplace_back();
  object.material.index = invalid_index;
  Fields fields(reading, at, "an object");
  if (!fields) return;
  std::size_t type = 0;
  const bool type_known = fields.required("type", Word<std::size_t>{type, "object.type", object_types});
  if (!type_known || object_types[type].first != tracer::Instance::type) {
    if (const auto material = fields.take("material")) {
      object.material = read_material_reference(reading, *material);
    } else {
      fields.report_missing_field("material");
    }
  }
  if (const auto transform = fields.take("transform")) read_transform(reading, *transform, object.transform);
  if (!type_known) return;  // which other fields it may have is unknown
  read_alternative(object.shape, type, [&](auto& shape) {
    fields.set_kind(shape.noun);
    if constexpr (std::is_same_v<std::decay_t<decltype(shape)>, tracer::Mesh>) {
      read_mesh(reading, fields, object.shape);
    } else {
      read_shape(reading, fields, shape);
    }
  });
  fields.finish();
}

void read_object_list(Reading& reading, const Cursor& at, std::vector<tracer::Object>& objects) {
  if (!within_limit(reading, at, "objects", reading.limits.scene.objects)) return;
  if (at.node->kind == json::Kind::array) objects.reserve(at.node->size);
  for_each_element(reading, at, [&](const Cursor& object) { read_object(reading, object, objects); });
}

}  // namespace

tracer::PrototypeId read_prototype_reference(Reading& reading, const Cursor& at) {
  if (at.node->kind == json::Kind::string) return find(reading, at, reading.prototypes, "prototypes");
  add_wrong_type(reading, at, "the name of a prototype");
  return {invalid_index};
}

void read_objects(Reading& reading, const Cursor& at) { read_object_list(reading, at, reading.scene().objects); }

void read_prototypes(Reading& reading, const Cursor& at) {
  // Names first: an instance may stand before what it places. Lists second, each by its index.
  std::vector<tracer::Prototype>& prototypes = reading.scene().prototypes;
  reading.prototypes.complete = within_limit(reading, at, "objects", reading.limits.scene.objects);
  if (!reading.prototypes.complete) return;
  reading.prototypes.complete = for_each_member(reading, at, [&](const Cursor& member) {
    const tracer::PrototypeId id{static_cast<std::uint32_t>(prototypes.size())};
    prototypes.push_back({{}, pointer(member)});
    if (!reading.prototypes.ids.emplace(member.key, id).second)
      add_issue(reading, member, "duplicate_key", quoted(member.key) + " is defined twice");
  });
  if (!reading.prototypes.complete) return;
  std::size_t index = 0;
  for_each_member(reading, at,
                  [&](const Cursor& member) { read_object_list(reading, member, prototypes[index++].objects); });
}

}  // namespace api
