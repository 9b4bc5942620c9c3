#include <cstdint>
#include <limits>

#include "api/src/reader/fields.h"
#include "api/src/reader/sections.h"

namespace api {
namespace {

enum class ObjectType { sphere, plane, triangle, mesh };

constexpr Word<ObjectType>::Meaning object_types[] = {{"sphere", ObjectType::sphere},
                                                      {"plane", ObjectType::plane},
                                                      {"triangle", ObjectType::triangle},
                                                      {"mesh", ObjectType::mesh}};

bool is_along_x(const tracer::Vec3& v) { return v.y == 0 && v.z == 0; }

void read_sphere(Fields& fields, tracer::Sphere& sphere) {
  fields.call_it("a sphere");
  fields.required("center", sphere.center);
  fields.required("radius", sphere.radius);
  fields.optional("axis", sphere.axis);
  if (!fields.optional("meridian", sphere.meridian) && !fields.has("meridian") && is_along_x(sphere.axis)) {
    sphere.meridian = {0, 0, 1};  // the default +x is the pole then; z as for every other first axis
  }
}

void read_plane(Fields& fields, tracer::Plane& plane) {
  fields.call_it("a plane");
  fields.required("point", plane.point);
  fields.required("normal", plane.normal);
  if (fields.has("u_axis")) fields.optional("u_axis", plane.u_axis.emplace());
}

void read_triangle(Fields& fields, tracer::Triangle& triangle) {
  fields.call_it("a triangle");
  fields.required("vertices", triangle.vertices);
  if (fields.has("normals")) fields.optional("normals", triangle.normals.emplace());
  if (fields.has("uvs")) fields.optional("uvs", triangle.uvs.emplace());
}

void read_object(Reading& reading, const Cursor& at) {
  // Kept even when it is bad, so that the next ones have the document's index.
  tracer::Object& object = reading.scene().objects.emplace_back();
  object.material.index = std::numeric_limits<std::uint32_t>::max();
  Fields fields(reading, at, "object", "an object");
  if (!fields) return;
  ObjectType type{};
  const bool type_known = fields.required("type", Word<ObjectType>{type, "object.type", object_types});
  if (const auto material = fields.take("material")) {
    object.material = read_material_reference(reading, *material);
  } else {
    fields.tell_missing("material");
  }
  if (!type_known) return;  // which other fields it may have is unknown
  switch (type) {
    case ObjectType::sphere:
      read_sphere(fields, object.shape.emplace<tracer::Sphere>());
      break;
    case ObjectType::plane:
      read_plane(fields, object.shape.emplace<tracer::Plane>());
      break;
    case ObjectType::triangle:
      read_triangle(fields, object.shape.emplace<tracer::Triangle>());
      break;
    case ObjectType::mesh:
      fields.call_it("a mesh");
      read_mesh(reading, fields, object.shape);
      break;
  }
  fields.finish();
}

}  // namespace

void read_objects(Reading& reading, const Cursor& at) {
  if (!within_limit(reading, at, "objects", reading.limits.scene.objects)) return;
  if (at.node->kind == json::Kind::array) reading.scene().objects.reserve(at.node->size);
  for_each_element(reading, at, [&](const Cursor& object) { read_object(reading, object); });
}

}  // namespace api
