/// Image size, camera, lights, background, depth cue and output.

#include <algorithm>
#include <cmath>

#include "api/reader/fields.h"
#include "api/src/reader/sections.h"

namespace api {

bool read(Reading& reading, const Cursor& at, tracer::Attenuation& attenuation) {
  if (at.node->kind == json::Kind::string) return read(reading, at, attenuation.kind);
  if (at.node->kind != json::Kind::array)
    return add_wrong_type(reading, at, "\"none\", \"inverse_square\" or [c0, c1, c2]");
  attenuation.kind = tracer::Attenuation::Kind::polynomial;
  return read(reading, at, attenuation.coefficients);
}

bool read(Reading& reading, const Cursor& at, std::optional<tracer::PixelWindow>& window) {
  std::array<std::uint32_t, 4> edges{};
  const bool valid = read(reading, at, edges);
  if (valid) window = {edges[0], edges[1], edges[2], edges[3]};
  return valid;
}

namespace {

void read_cube(Reading& reading, const Cursor& at, tracer::CubeMap& cube) {
  constexpr std::string_view names[] = {"+x", "-x", "+y", "-y", "+z", "-z"};
  Fields fields(reading, at, "a cube");
  for (std::size_t face = 0; face < 6; ++face) fields.required(names[face], cube.faces[face]);
  fields.finish();
}

/// Sets a spot light's axis by a point on it. If the point is invalid, the axis keeps its default.
void read_target(Reading& reading, const Cursor& at, tracer::SpotLight& spot) {
  tracer::Vec3 target;
  if (!read(reading, at, target)) return;
  const tracer::Vec3& from = spot.position;
  const tracer::Vec3 axis{target.x - from.x, target.y - from.y, target.z - from.z};
  const double reach = std::max({std::abs(target.x), std::abs(target.y), std::abs(target.z)});
  const double length = std::max({std::abs(axis.x), std::abs(axis.y), std::abs(axis.z)});
  if (reach > reading.limits.scene.coordinate_max) {
    add_issue(reading, at, "limit_exceeded", "its coordinates exceed the limit coordinate_max");
  } else if (length < reading.limits.scene.length_min) {
    add_issue(reading, at, "degenerate", "must not be the position: the spot has no direction");
  } else if (std::isfinite(axis.x + axis.y + axis.z)) {  // false if the position is missing or invalid
    spot.direction = axis;
  }
}

template <class Source>
void read_source(Reading& /*reading*/, Fields& fields, Source& source) {
  read_all_fields(fields, source);
}

/// The axis is given by `direction` or by `target`, a point on it.
void read_source(Reading& reading, Fields& fields, tracer::SpotLight& spot) {
  const auto target = fields.take("target");
  tracer::for_each_field<tracer::SpotLight>([&](const auto& field) {
    if (field.name != "direction" || !target) read_field(fields, field, spot);
  });
  if (!target) return;
  if (fields.take("direction")) {
    add_issue(reading, *target, "conflict", "must not be combined with `direction`: each gives the axis");
  } else {
    read_target(reading, *target, spot);
  }
}

template <class Source>
constexpr bool has_surface = Source::is_area_light && !std::is_same_v<Source, tracer::LineLight>;

tracer::Shape surface_of(const tracer::LightSource& source) {
  if (const auto* disc = std::get_if<tracer::DiscLight>(&source))
    return tracer::Disc{disc->center, disc->normal, disc->radius, 0, {}};
  if (const auto* sphere = std::get_if<tracer::SphereLight>(&source))
    return tracer::Sphere{.center = sphere->center, .radius = sphere->radius};
  const auto& rect = std::get<tracer::RectLight>(source);
  const auto at = [&corner = rect.corner, &u = rect.edge_u, &v = rect.edge_v](double s, double t) {
    return tracer::Vec3{corner.x + s * u.x + t * v.x, corner.y + s * u.y + t * v.y, corner.z + s * u.z + t * v.z};
  };
  return tracer::Mesh{{at(0, 0), at(1, 0), at(1, 1), at(0, 1)}, {{0, 1, 2}, {0, 2, 3}}, {}, {}, false, {}};
}

void read_light(Reading& reading, const Cursor& at) {
  tracer::Light& light = reading.scene().lights.emplace_back();
  Fields fields(reading, at, "a light");
  std::size_t type = 0;
  const bool type_known = fields.required("type", OneOf<std::size_t>{type, type_words<tracer::LightSource>});
  read_all_fields(fields, light);
  if (!fields) add_wrong_type(reading, at, R"(an object such as {"type": "point", "position": [x, y, z]})");
  if (!type_known) return;  // its other fields depend on the type
  read_alternative(light.source, type, [&](auto& source) {
    fields.set_kind(source.noun);
    read_source(reading, fields, source);
    if constexpr (has_surface<std::decay_t<decltype(source)>>)
      if (bool visible = false; fields.optional("visible", visible) && visible)
        reading.visible_lights.push_back(static_cast<std::uint32_t>(reading.scene().lights.size() - 1));
  });
  fields.finish();
}

}  // namespace

/// The fields of other types are allowed and have no effect: a type is changed by changing one word.
void read_camera(Reading& reading, const Cursor& at) {
  tracer::Camera& camera = reading.scene().camera;
  Fields fields(reading, at, "the camera");
  tracer::for_each_field<tracer::Camera>([&](auto field) {
    if (field.name == "height" && camera.type == tracer::Camera::Type::orthographic)
      field.presence = tracer::FieldPresence::required;
    read_field(fields, field, camera);
  });
  if (camera.layout == tracer::Camera::Layout::single && camera.eye_separation > 0)
    camera.layout = tracer::Camera::Layout::side_by_side;
  fields.finish();
}

void read_background(Reading& reading, const Cursor& at) {
  tracer::Background& background = reading.scene().background;
  const json::Kind kind = at.node->kind;
  if (kind == json::Kind::number || kind == json::Kind::string || kind == json::Kind::array ||
      reading.tape.find_key(at.node, "hsb") != nullptr) {
    if (tracer::Color& color = background.color; read(reading, at, color) && std::min({color.r, color.g, color.b}) < 0)
      add_issue(reading, at, "out_of_range", "must be >= 0");
    return;
  }
  Fields fields(reading, at, "the background");
  const auto read_form = [&](auto& form) {
    fields.set_kind(form.noun);
    read_all_fields(fields, form);
  };
  if (fields.has("environment")) {
    read_form(background.environment.emplace());
  } else if (const auto cube = fields.take("cube")) {
    fields.set_kind("a background with a cube");
    read_cube(reading, *cube, background.cube.emplace());
  } else if (fields.has("zenith") || fields.has("nadir")) {
    read_form(background.gradient.emplace());
  } else {
    fields.optional("color", background.color);
    for (const std::string_view other : {"zenith", "nadir", "environment"}) fields.take(other);
  }
  const bool has_zenith = background.environment || background.cube || background.gradient;
  constexpr Word<std::optional<tracer::Vec3>> of_the_camera[] = {{"camera", std::nullopt}};
  if (const auto up = has_zenith ? fields.take("up") : std::nullopt; up && up->node->kind == json::Kind::string) {
    read(reading, *up, OneOf<std::optional<tracer::Vec3>>{background.up, of_the_camera});
  } else if (up) {
    read(reading, *up, background.up);
  }
  fields.finish();
}

/// Each light is a prototype of its own, because a prototype has the pointer for issues.
void add_visible_lights(Reading& reading) {
  tracer::Scene& scene = reading.scene();
  for (const std::uint32_t index : reading.visible_lights) {
    const auto& [source, color, intensity, shadows, attenuation] = scene.lights[index];
    const std::string path = "/lights/" + std::to_string(index);
    const tracer::MaterialId material{static_cast<std::uint32_t>(scene.materials.size())};
    scene.materials.push_back({.color = tracer::Color{},
                               .ambient = 0,
                               .diffuse = 0,
                               .emission = tracer::Color{color.r * intensity, color.g * intensity, color.b * intensity},
                               .path = path});
    const tracer::PrototypeId prototype{static_cast<std::uint32_t>(scene.prototypes.size())};
    scene.prototypes.push_back(
        {.objects = {{.shape = surface_of(source), .material = material}}, .path = path, .is_one_object = true});
    tracer::Object& object = scene.objects.emplace_back();
    object.shape = tracer::Instance{prototype, {}};
    object.shadow = false;
  }
}

void read_lights(Reading& reading, const Cursor& at) {
  if (!within_limit(reading, at, "lights", reading.limits.scene.lights)) return;
  for_each_element(
      reading, at, [&](const Cursor& light) { read_light(reading, light); },
      R"(a list of lights: [{"type": "point", "position": [x, y, z]}, ...])");
}

}  // namespace api
