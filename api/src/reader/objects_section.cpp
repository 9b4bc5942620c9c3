#include <cstdint>
#include <vector>

#include "api/src/reader/fields.h"
#include "api/src/reader/references.h"
#include "api/src/reader/sections.h"

namespace api {
namespace {

enum class ObjectType { sphere, plane, disc, cylinder, cone, box, triangle, mesh, instance };

constexpr Word<ObjectType>::Meaning object_types[] = {
    {"sphere", ObjectType::sphere},     {"plane", ObjectType::plane}, {"disc", ObjectType::disc},
    {"cylinder", ObjectType::cylinder}, {"cone", ObjectType::cone},   {"box", ObjectType::box},
    {"triangle", ObjectType::triangle}, {"mesh", ObjectType::mesh},   {"instance", ObjectType::instance}};

bool is_along_x(const tracer::Vec3& v) { return v.y == 0 && v.z == 0; }

void read_sphere(Fields& fields, tracer::Sphere& sphere) {
  fields.set_kind("a sphere");
  fields.required("center", sphere.center);
  fields.required("radius", sphere.radius);
  fields.optional("axis", sphere.axis);
  if (!fields.optional("meridian", sphere.meridian) && !fields.has("meridian") && is_along_x(sphere.axis)) {
    sphere.meridian = {0, 0, 1};  // the default +x is the pole then; z as for every other first axis
  }
}

void read_u_axis(Fields& fields, std::optional<tracer::Vec3>& u_axis) {
  if (fields.has("u_axis")) fields.optional("u_axis", u_axis.emplace());
}

void read_plane(Fields& fields, tracer::Plane& plane) {
  fields.set_kind("a plane");
  fields.required("point", plane.point);
  fields.required("normal", plane.normal);
  read_u_axis(fields, plane.u_axis);
}

void read_disc(Fields& fields, tracer::Disc& disc) {
  fields.set_kind("a disc");
  fields.required("center", disc.center);
  fields.required("normal", disc.normal);
  fields.required("radius", disc.radius);
  fields.optional("inner_radius", disc.inner_radius);
  read_u_axis(fields, disc.u_axis);
}

void read_cylinder(Fields& fields, tracer::Cylinder& cylinder) {
  fields.set_kind("a cylinder");
  fields.required("from", cylinder.from);
  fields.required("to", cylinder.to);
  fields.required("radius", cylinder.radius);
  fields.optional("caps", cylinder.caps);
  read_u_axis(fields, cylinder.u_axis);
}

void read_cone(Fields& fields, tracer::Cone& cone) {
  fields.set_kind("a cone");
  fields.required("apex", cone.apex);
  fields.required("base", cone.base);
  fields.required("radius", cone.radius);
  fields.optional("apex_radius", cone.apex_radius);
  fields.optional("caps", cone.caps);
  read_u_axis(fields, cone.u_axis);
}

void read_box(Fields& fields, tracer::Box& box) {
  fields.set_kind("a box");
  fields.required("min", box.min);
  fields.required("max", box.max);
}

void read_triangle(Fields& fields, tracer::Triangle& triangle) {
  fields.set_kind("a triangle");
  fields.required("vertices", triangle.vertices);
  if (fields.has("normals")) fields.optional("normals", triangle.normals.emplace());
  if (fields.has("uvs")) fields.optional("uvs", triangle.uvs.emplace());
}

/// `of` names a prototype, whether it stands before or after this.
void read_instance(Reading& reading, Fields& fields, tracer::Instance& instance) {
  fields.set_kind("an instance");
  if (const auto of = fields.take("of")) {
    instance.of = read_prototype_reference(reading, *of);
  } else {
    fields.report_missing_field("of");
  }
  if (const auto material = fields.take("material")) instance.material = read_material_reference(reading, *material);
}

void read_shape(Reading& reading, Fields& fields, ObjectType type, tracer::Shape& shape) {
  switch (type) {
    case ObjectType::sphere:
      return read_sphere(fields, shape.emplace<tracer::Sphere>());
    case ObjectType::plane:
      return read_plane(fields, shape.emplace<tracer::Plane>());
    case ObjectType::disc:
      return read_disc(fields, shape.emplace<tracer::Disc>());
    case ObjectType::cylinder:
      return read_cylinder(fields, shape.emplace<tracer::Cylinder>());
    case ObjectType::cone:
      return read_cone(fields, shape.emplace<tracer::Cone>());
    case ObjectType::box:
      return read_box(fields, shape.emplace<tracer::Box>());
    case ObjectType::triangle:
      return read_triangle(fields, shape.emplace<tracer::Triangle>());
    case ObjectType::mesh:
      fields.set_kind("a mesh");
      return read_mesh(reading, fields, shape);
    case ObjectType::instance:
      return read_instance(reading, fields, shape.emplace<tracer::Instance>());
  }
}

void read_object(Reading& reading, const Cursor& at, std::vector<tracer::Object>& objects) {
  // Kept even when it is bad, so that the next ones have the document's index.
  tracer::Object& object = objects.emplace_back();
  object.material.index = nothing;
  Fields fields(reading, at, "an object");
  if (!fields) return;
  ObjectType type{};
  const bool type_known = fields.required("type", Word<ObjectType>{type, "object.type", object_types});
  if (!type_known || type != ObjectType::instance) {
    if (const auto material = fields.take("material")) {
      object.material = read_material_reference(reading, *material);
    } else {
      fields.report_missing_field("material");
    }
  }
  if (const auto transform = fields.take("transform")) read_transform(reading, *transform, object.transform);
  if (!type_known) return;  // which other fields it may have is unknown
  read_shape(reading, fields, type, object.shape);
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
  tell_wrong_type(reading, at, "the name of a prototype");
  return {nothing};
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
      tell(reading, member, "duplicate_key", in_quotes(member.key) + " is defined twice");
  });
  if (!reading.prototypes.complete) return;
  std::size_t index = 0;
  for_each_member(reading, at,
                  [&](const Cursor& member) { read_object_list(reading, member, prototypes[index++].objects); });
}

}  // namespace api
