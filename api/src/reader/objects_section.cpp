#include <cstdint>
#include <vector>

#include "api/src/reader/fields.h"
#include "api/src/reader/names.h"
#include "api/src/reader/sections.h"

namespace api {
namespace {

constexpr auto& object_types = type_words<tracer::Shape>;

template <tracer::HasFields Shape>
void read_shape(Fields& fields, Shape& shape) {
  read_all_fields(fields, shape);
}

void read_shape(Fields& fields, tracer::Sphere& sphere) {
  read_all_fields(fields, sphere);
  // The meridian's default +x would be the pole; +z is perpendicular to the axis.
  if (!fields.has("meridian") && sphere.axis.y == 0 && sphere.axis.z == 0) sphere.meridian = {0, 0, 1};
}

/// The prototype may be defined before or after the instance.
void read_shape(Fields& fields, tracer::Instance& instance) {
  fields.required("of", instance.of);
  fields.optional("material", instance.material);
}

void read_object(Reading& reading, const Cursor& at, std::vector<tracer::Object>& objects) {
  // An invalid object is kept, so that indices remain those of the document.
  tracer::Object& object = objects.emplace_back();
  set_invalid(object.material);
  Fields fields(reading, at, "an object");
  if (!fields) return;
  std::size_t type = 0;
  const bool type_known = fields.required("type", OneOf<std::size_t>{type, object_types});
  if (!type_known || object_types[type].first != tracer::Instance::type) fields.required("material", object.material);
  fields.optional("transform", object.transform);
  if (!type_known) return;  // its other fields depend on the type
  read_alternative(object.shape, type, [&](auto& shape) {
    fields.set_kind(shape.noun);
    if constexpr (std::is_same_v<std::decay_t<decltype(shape)>, tracer::Mesh>) {
      read_mesh(reading, fields, object.shape);
    } else {
      read_shape(fields, shape);
    }
  });
  fields.finish();
}

void read_object_list(Reading& reading, const Cursor& at, std::vector<tracer::Object>& objects) {
  if (!within_limit(reading, at, "objects", reading.limits.scene.objects)) return;
  if (at.node->kind == json::Kind::array) objects.reserve(at.node->size);
  for_each_element(reading, at, [&](const Cursor& object) { read_object(reading, object, objects); });
}

tracer::PrototypeId add_prototype(Reading& reading, const Cursor& at) {
  std::vector<tracer::Prototype>& prototypes = reading.scene().prototypes;
  prototypes.push_back({{}, pointer(at)});
  return {static_cast<std::uint32_t>(prototypes.size() - 1)};
}

}  // namespace

bool read(Reading& reading, const Cursor& at, tracer::PrototypeId& prototype) {
  set_invalid(prototype);
  if (at.node->kind != json::Kind::string) return add_wrong_type(reading, at, "the name of a prototype");
  return find_name(reading, at, reading.prototypes, "prototypes", prototype);
}

void read_objects(Reading& reading, const Cursor& at) { read_object_list(reading, at, reading.scene().objects); }

void read_prototypes(Reading& reading, const Cursor& at) {
  // All names first, because an instance may stand before the prototype that it places; then the lists.
  reading.prototypes.complete = within_limit(reading, at, "objects", reading.limits.scene.objects);
  if (!reading.prototypes.complete) return;
  read_names(reading, at, reading.prototypes, add_prototype);
  if (!reading.prototypes.complete) return;
  std::vector<tracer::Prototype>& prototypes = reading.scene().prototypes;
  for_each_member(reading, at, [&](const Cursor& member) {
    // A duplicate's objects are read too, for their issues.
    read_object_list(reading, member, prototypes[reading.prototypes.ids[member.key].index].objects);
  });
}

}  // namespace api
