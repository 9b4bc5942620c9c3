/// Objects and prototypes with their meshes. Inline meshes are by far the longest part of long
/// documents, so the common case uses no cursor per number.

#include <algorithm>
#include <array>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "api/reader/fields.h"
#include "api/src/reader/sections.h"
#include "tracer/triangulate.h"

namespace api {
namespace {

using tracer::Vec3;

using Corners = std::array<std::uint32_t, 3>;
constexpr std::uint32_t index_max = std::numeric_limits<std::uint32_t>::max() - 1;

/// Reads three indices without a cursor for each; false if they need issues.
bool read_plain(const json::Node* node, Corners& corners) {
  if (node->kind != json::Kind::array || node->size != 3) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    const json::Node& element = node[1 + i];
    const double number = element.number;
    if (element.kind != json::Kind::number || !(number >= 0 && number <= index_max)) return false;
    corners[i] = static_cast<std::uint32_t>(number);
    if (static_cast<double>(corners[i]) != number) return false;
  }
  return true;
}

bool read_index(Reading& reading, const Cursor& at, std::uint32_t& index) {
  return read(reading, at, Integer<std::uint32_t>{index, 0, index_max});
}

/// False, with one issue for all of them, if the numbers of a list of vectors are not in groups of the given form.
bool is_grouped(Reading& reading, const Cursor& at, std::string_view form) {
  if (at.node->kind != json::Kind::array)
    return add_wrong_type(reading, at, "a list: [" + std::string(form) + ", ...]");
  const std::uint32_t size = at.node->size;
  const auto is_number = [](const json::Node& element) { return element.kind == json::Kind::number; };
  return size < 2 || !std::all_of(at.node + 1, at.node + 1 + size, is_number) ||
         add_issue(reading, at, "wrong_type",
                   "must be a list of lists, [" + std::string(form) + ", ...], got " + std::to_string(size) +
                       " numbers without inner brackets");
}

/// Appends an element to `values` for each element of the array.
template <class T, class ReadElement>
bool read_list(Reading& reading, const Cursor& at, std::string_view form, std::vector<T>& values,
               const ReadElement& read_element) {
  if (!is_grouped(reading, at, form)) return false;
  values.reserve(at.node->size);
  return for_each_element(reading, at, [&](const Cursor& element) { read_element(element, values.emplace_back()); });
}

template <class Vector>
bool read_vectors(Reading& reading, const std::optional<Cursor>& at, std::vector<Vector>& vectors) {
  return at && read_list(reading, *at, form_of<Vector>, vectors,
                         [&](const Cursor& element, Vector& vector) { read(reading, element, vector); });
}

void read_triangles(Reading& reading, const Cursor& at, tracer::Mesh& mesh) {
  read_list(reading, at, "[0, 1, 2]", mesh.triangles, [&](const Cursor& element, Corners& corners) {
    if (read_plain(element.node, corners)) return;
    corners = {};
    if (!expect_length(reading, element, 3, "three indices: [0, 1, 2]")) return;
    for_each_element(reading, element,
                     [&](const Cursor& corner) { read_index(reading, corner, corners[corner.index]); });
  });
}

/// The indices of a polygon's corners. Returns false, with an issue, if one is invalid.
bool read_polygon(Reading& reading, const Cursor& at, std::size_t position_count, std::vector<std::uint32_t>& polygon) {
  polygon.clear();
  bool valid = true;
  if (at.node->kind == json::Kind::array && at.node->size < 3)
    return add_issue(reading, at, "wrong_length",
                     "a face must have at least 3 corners, has " + std::to_string(at.node->size));
  const bool is_array = for_each_element(reading, at, [&](const Cursor& corner) {
    std::uint32_t& index = polygon.emplace_back();
    valid &= read_index(reading, corner, index) &&
             (index < position_count || add_issue(reading, corner, "out_of_range",
                                                  "must be the index of one of the " + std::to_string(position_count) +
                                                      " positions, got " + std::to_string(index)));
  });
  return is_array && valid;
}

void read_faces(Reading& reading, const Cursor& at, tracer::Mesh& mesh) {
  if (!is_grouped(reading, at, "[0, 1, 2, 3]")) return;
  std::vector<std::uint32_t> polygon;
  std::vector<tracer::Vec3> corners;
  for_each_element(reading, at, [&](const Cursor& element) {
    if (!read_polygon(reading, element, mesh.positions.size(), polygon)) return;
    corners.clear();
    for (const std::uint32_t index : polygon) corners.push_back(mesh.positions[index]);
    if (!tracer::add_polygon(polygon, corners, mesh))
      add_issue(reading, element, "limit_exceeded",
                "the limit ear_clipping_corners_max is " + std::to_string(tracer::ear_clipping_corners_max) +
                    " for faces that are no fan around their first corner (convex ones are), this one has " +
                    std::to_string(polygon.size()));
  });
}

void read_connectivity(Reading& reading, Fields& fields, tracer::Mesh& mesh) {
  const auto faces = fields.take("faces");
  const auto triangles = faces ? fields.take("triangles") : fields.take_required("triangles", "[[0, 1, 2], ...]");
  if (triangles) read_triangles(reading, *triangles, mesh);
  if (triangles && faces) {
    add_issue(reading, *faces, "conflict", "a mesh has \"triangles\" or \"faces\", not both");
  } else if (faces) {
    read_faces(reading, *faces, mesh);
  }
}

tracer::MaterialId read_material(Reading& reading, const Cursor& at) {
  tracer::MaterialId material{};
  read(reading, at, material);
  return material;
}

/// Files of a glTF file's buffers. The first list of a file counts.
void read_buffers(Reading& reading, const Cursor& at, std::optional<tracer::AssetId> file) {
  std::vector<tracer::AssetId> buffers;
  for_each_element(reading, at, [&](const Cursor& buffer) { read(reading, buffer, buffers.emplace_back()); });
  if (file && reading.scene().assets[file->index].buffers.empty())
    reading.scene().assets[file->index].buffers = std::move(buffers);
}

/// The fields that the file contains must not be written in the document too.
void read_file(Reading& reading, Fields& fields, tracer::Mesh& mesh) {
  fields.set_kind("a mesh with a file");
  if (tracer::AssetId asset; fields.optional("file", asset)) mesh.file = asset;
  if (const auto buffers = fields.take("buffers")) read_buffers(reading, *buffers, mesh.file);
  if (double time = 0; fields.optional("time", time)) mesh.time = static_cast<float>(time);
  if (const auto materials = fields.take("materials"))
    read_names(reading, *materials, mesh.part_materials, read_material,
               "an object of materials by their names in the file: {\"NAME\": MATERIAL}");
  for (const std::string_view name : {"positions", "triangles", "faces", "normals", "uvs"})
    if (fields.has(name))
      add_issue(reading, *fields.take(name), "conflict", "must not be written: the mesh's file contains it");
}

void read_mesh(Reading& reading, Fields& fields, tracer::Shape& shape) {
  auto& mesh = shape.emplace<tracer::Mesh>();
  fields.optional("smooth", mesh.smooth);
  if (fields.has("file")) return read_file(reading, fields, mesh);
  const bool has_positions =
      read_vectors(reading, fields.take_required("positions", "[[x, y, z], ...]"), mesh.positions);
  read_connectivity(reading, fields, mesh);
  read_vectors(reading, fields.take("normals"), mesh.normals);
  read_vectors(reading, fields.take("uvs"), mesh.uvs);
  if (!has_positions) shape = tracer::Sphere{};  // without positions, validate would report every index
}

constexpr auto& object_types = type_words<tracer::Shape>;

/// The point that places a shape; the origin if it is left out and the object has a `position`.
bool read_anchor(Fields& fields, std::string_view name, Vec3& point) {
  if (fields.has(name) || !fields.has("position")) return fields.required(name, point);
  fields.take(name);
  return true;
}

void refuse(Reading& reading, Fields& fields, std::initializer_list<std::string_view> names, std::string_view with) {
  for (const std::string_view name : names)
    if (fields.has(name))
      add_issue(reading, *fields.take(name), "conflict", "must not be combined with " + quoted(with));
}

/// All fields, except `without`.
template <tracer::HasFields Shape>
void read_shape(Reading& /*reading*/, Fields& fields, Shape& shape,
                std::initializer_list<std::string_view> without = {}) {
  tracer::for_each_field<Shape>([&](const auto& field) {
    if (std::ranges::find(without, field.name) != without.end()) return;
    if constexpr (std::is_same_v<std::decay_t<decltype(shape.*field.member)>, Vec3>)
      if (field.name == "center" || field.name == "point" || field.name == "base") {
        read_anchor(fields, field.name, shape.*field.member);
        return;
      }
    read_field(fields, field, shape);
  });
}

void read_shape(Reading& reading, Fields& fields, tracer::Sphere& sphere) {
  read_shape<tracer::Sphere>(reading, fields, sphere, {});
  // The meridian's default +x would be the pole; +z is perpendicular to the axis.
  if (!fields.has("meridian") && sphere.axis.y == 0 && sphere.axis.z == 0) sphere.meridian = {0, 0, 1};
}

/// By `min` and `max`, or by `center` and `size`. An invalid box keeps its default.
void read_shape(Reading& reading, Fields& fields, tracer::Box& box) {
  if (!fields.has("size") && !fields.has("center")) return read_all_fields(fields, box);
  Vec3 center, size;
  const bool has_center = read_anchor(fields, "center", center);
  const auto field = fields.take_required("size", "NUMBER or [x, y, z]");
  const bool has_size = field && read_per_axis(reading, *field, size) &&
                        ((size.x > 0 && size.y > 0 && size.z > 0) ||
                         add_issue(reading, *field, "out_of_range", "must be > 0 along each axis"));
  refuse(reading, fields, {"min", "max"}, "size");
  if (!has_center || !has_size) return;
  box.min = {center.x - size.x / 2, center.y - size.y / 2, center.z - size.z / 2};
  box.max = {center.x + size.x / 2, center.y + size.y / 2, center.z + size.z / 2};
}

/// A shape from `base` up to `height`, along +y, in place of the fields `replaced`.
void read_upright(Reading& reading, Fields& fields, std::initializer_list<std::string_view> replaced, Vec3& base,
                  Vec3& top) {
  double height = 0;
  const bool has_base = read_anchor(fields, "base", base);
  const auto field = fields.take_required("height", form_of<double>);
  const bool has_height =
      field && read(reading, *field, height) &&
      (height > 0 || add_issue(reading, *field, "out_of_range", "must be > 0, got " + number_text(height)));
  refuse(reading, fields, replaced, "height");
  if (!has_base || !has_height) base = {}, height = 1;  // valid, so that no other issue follows
  top = {base.x, base.y + height, base.z};
}

void read_shape(Reading& reading, Fields& fields, tracer::Cylinder& cylinder) {
  if (!fields.has("base") && !fields.has("height")) return read_all_fields(fields, cylinder);
  read_upright(reading, fields, {"from", "to"}, cylinder.from, cylinder.to);
  read_shape<tracer::Cylinder>(reading, fields, cylinder, {"from", "to"});
}

void read_shape(Reading& reading, Fields& fields, tracer::Cone& cone) {
  if (!fields.has("height")) return read_shape<tracer::Cone>(reading, fields, cone, {});
  read_upright(reading, fields, {"apex"}, cone.base, cone.apex);
  read_shape<tracer::Cone>(reading, fields, cone, {"apex", "base"});
}

/// The prototype may be defined before or after the instance.
void read_shape(Reading& /*reading*/, Fields& fields, tracer::Instance& instance) {
  fields.required("of", instance.of);
  fields.optional("material", instance.material);
}

void read_object(Reading& reading, const Cursor& at, std::vector<tracer::Object>& objects) {
  // An invalid object is kept, so that indices remain those of the document.
  tracer::Object& object = objects.emplace_back();
  set_invalid(object.material);
  Fields fields(reading, at, "an object");
  if (!fields) {
    add_wrong_type(reading, at, R"(an object such as {"type": "sphere", ...})");
    return;
  }
  std::size_t type = 0;
  const bool type_known = fields.required("type", OneOf<std::size_t>{type, object_types});
  if (!type_known || object_types[type].first != tracer::Instance::type) fields.required("material", object.material);
  read_placement(reading, fields, object.transform);
  fields.optional("shadow", object.shadow);
  if (!type_known) return;  // its other fields depend on the type
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
  for_each_element(
      reading, at, [&](const Cursor& object) { read_object(reading, object, objects); },
      R"(a list of objects: [{"type": "sphere", ...}, ...])");
}

tracer::PrototypeId add_prototype(Reading& reading, const Cursor& at) {
  std::vector<tracer::Prototype>& prototypes = reading.scene().prototypes;
  prototypes.push_back({{}, pointer(at)});
  return {static_cast<std::uint32_t>(prototypes.size() - 1)};
}

}  // namespace

bool read(Reading& reading, const Cursor& at, tracer::PrototypeId& prototype) {
  set_invalid(prototype);
  if (!expect_string(reading, at, "the name of a prototype")) return false;
  return find_name(reading, at, reading.prototypes, "prototypes", prototype);
}

void read_objects(Reading& reading, const Cursor& at) { read_object_list(reading, at, reading.scene().objects); }

void read_prototypes(Reading& reading, const Cursor& at) {
  // All names first, because an instance may stand before the prototype that it places; then the lists.
  reading.prototypes.complete = within_limit(reading, at, "objects", reading.limits.scene.objects) &&
                                read_names(reading, at, reading.prototypes.ids, add_prototype);
  if (!reading.prototypes.complete) return;
  std::vector<tracer::Prototype>& prototypes = reading.scene().prototypes;
  for_each_member(reading, at, [&](const Cursor& member) {
    // A duplicate's objects are read too, for their issues.
    read_object_list(reading, member, prototypes[reading.prototypes.ids[member.key].index].objects);
  });
}

}  // namespace api
