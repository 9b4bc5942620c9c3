/// Materials: named ones in their map, and those written in place.

#include <limits>
#include <vector>

#include "api/src/reader/fields.h"
#include "api/src/reader/names.h"
#include "api/src/reader/sections.h"

namespace api {

using Model = tracer::Material::Model;
using Transparency = tracer::Material::Transparency;
using Shading = tracer::Material::Shading;

template <>
inline constexpr Word<Model> words<Model>[] = {
    {"lambert", Model::lambert}, {"phong", Model::phong}, {"blinn_phong", Model::blinn_phong}};
template <>
inline constexpr Word<Transparency> words<Transparency>[] = {{"refract", Transparency::refract},
                                                             {"interpolated", Transparency::interpolated},
                                                             {"filtered", Transparency::filtered}};
template <>
inline constexpr Word<Shading> words<Shading>[] = {
    {"smooth", Shading::smooth}, {"flat", Shading::flat}, {"gouraud", Shading::gouraud}};

namespace {

/// The default reflection depends on `fresnel`, whose default depends on the transmission.
void read_reflection(Fields& fields, tracer::Material& material) {
  fields.optional("transparency", material.transparency);
  const bool transmits = fields.optional("transmission", material.transmission) && material.transmission > 0;
  material.fresnel = transmits && material.transparency == Transparency::refract;
  fields.optional("fresnel", material.fresnel);
  if (material.fresnel) material.reflection = 1;
  fields.optional("reflection", material.reflection);
}

void read_bump(Reading& reading, const Cursor& at, tracer::Bump& bump) {
  set_invalid(bump.texture);
  Fields fields(reading, at, "a bump");
  fields.required("texture", bump.texture);
  fields.optional("scale", bump.scale);
  fields.finish();
}

tracer::MaterialId add_material(Reading& reading, const Cursor& at) {
  std::vector<tracer::Material>& materials = reading.scene().materials;
  if (!has_capacity(reading, at, materials.size(), "materials", reading.limits.scene.materials)) return {invalid_index};
  const tracer::MaterialId id{static_cast<std::uint32_t>(materials.size())};
  tracer::Material& material = materials.emplace_back();
  material.path = pointer(at);
  Fields fields(reading, at, "a material");
  fields.optional("model", material.model);
  fields.optional("color", material.color);
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
  fields.optional("shading", material.shading);
  fields.optional("normal_map", material.normal_map);
  if (const auto bump = fields.take("bump")) read_bump(reading, *bump, material.bump.emplace());
  fields.finish();
  return id;
}

}  // namespace

void read_materials(Reading& reading, const Cursor& at) {
  reading.materials.complete = within_limit(reading, at, "materials", reading.limits.scene.materials);
  if (reading.materials.complete) read_names(reading, at, reading.materials, add_material);
}

bool read(Reading& reading, const Cursor& at, tracer::MaterialId& material) {
  set_invalid(material);
  if (at.node->kind == json::Kind::string) return find_name(reading, at, reading.materials, "materials", material);
  if (at.node->kind != json::Kind::object) return add_wrong_type(reading, at, "a material's name or a material");
  material = add_material(reading, at);
  return true;
}

}  // namespace api
