/// Materials: named ones in their map, and those written in place.

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "api/src/reader/fields.h"
#include "api/src/reader/named.h"
#include "api/src/reader/references.h"
#include "api/src/reader/sections.h"

namespace api {
namespace {

using Model = tracer::Material::Model;
using Transparency = tracer::Material::Transparency;
using Shading = tracer::Material::Shading;

constexpr Word<Model>::Meaning models[] = {
    {"lambert", Model::lambert}, {"phong", Model::phong}, {"blinn_phong", Model::blinn_phong}};
constexpr Word<Transparency>::Meaning transparencies[] = {{"refract", Transparency::refract},
                                                          {"interpolated", Transparency::interpolated},
                                                          {"filtered", Transparency::filtered}};
constexpr Word<Shading>::Meaning shadings[] = {
    {"smooth", Shading::smooth}, {"flat", Shading::flat}, {"gouraud", Shading::gouraud}};

/// What a material reflects by default depends on whether Fresnel's equations hold, and that on what it transmits.
void read_reflection(Fields& fields, tracer::Material& material) {
  fields.optional("transparency", Word<Transparency>{material.transparency, "material.transparency", transparencies});
  const bool transmits = fields.optional("transmission", material.transmission) && material.transmission > 0;
  material.fresnel = transmits && material.transparency == Transparency::refract;
  fields.optional("fresnel", material.fresnel);
  if (material.fresnel) material.reflection = 1;
  fields.optional("reflection", material.reflection);
}

void read_bump(Reading& reading, const Cursor& at, std::optional<tracer::Bump>& bump) {
  Fields fields(reading, at, "a bump");
  if (!fields) return;
  bump.emplace().texture = {invalid_index};
  if (const auto texture = fields.take("texture")) {
    bump->texture = read_texture_reference(reading, *texture);
  } else {
    fields.report_missing_field("texture");
  }
  fields.optional("scale", bump->scale);
  fields.finish();
}

tracer::MaterialId add_material(Reading& reading, const Cursor& at) {
  std::vector<tracer::Material>& materials = reading.scene().materials;
  if (!has_capacity(reading, at, materials.size(), "materials", reading.limits.scene.materials)) return {invalid_index};
  const tracer::MaterialId id{static_cast<std::uint32_t>(materials.size())};
  tracer::Material& material = materials.emplace_back();
  material.path = pointer(at);
  Fields fields(reading, at, "a material");
  fields.optional("model", Word<Model>{material.model, "material.model", models});
  if (const auto color = fields.take("color")) read_color_or_texture(reading, *color, material.color);
  fields.optional("ambient", material.ambient);
  fields.optional("diffuse", material.diffuse);
  fields.optional("specular", material.specular);
  fields.optional("shininess", material.shininess);
  fields.optional("specular_color", material.specular_color);
  fields.optional("emission", material.emission);
  read_reflection(fields, material);
  fields.optional("reflection_color", material.reflection_color);
  fields.optional("transmission_color", material.transmission_color);
  fields.optional("ior", material.ior);
  fields.optional("priority", Integer<int>{material.priority, std::numeric_limits<int>::min()});
  fields.optional("absorption", material.absorption);
  fields.optional("shading", Word<Shading>{material.shading, "material.shading", shadings});
  if (const auto normals = fields.take("normal_map")) material.normal_map = read_texture_reference(reading, *normals);
  if (const auto bump = fields.take("bump")) read_bump(reading, *bump, material.bump);
  fields.finish();
  return id;
}

}  // namespace

void read_materials(Reading& reading, const Cursor& at) {
  reading.materials.complete = within_limit(reading, at, "materials", reading.limits.scene.materials);
  if (reading.materials.complete) read_named(reading, at, reading.materials, add_material);
}

tracer::MaterialId read_material_reference(Reading& reading, const Cursor& at) {
  if (at.node->kind == json::Kind::object) return add_material(reading, at);
  if (at.node->kind == json::Kind::string) return find(reading, at, reading.materials, "materials");
  add_wrong_type(reading, at, "a material's name or a material");
  return {invalid_index};
}

}  // namespace api
