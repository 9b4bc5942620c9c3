/// Textures and materials: named ones in their maps, and those written in place.

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "api/src/reader/fields.h"
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

/// Whether one more material or texture may be made of the value; tells so at the first that may not. Those after it
/// are not read, so that what is too much is never held.
bool has_room(Reading& reading, const Cursor& at, std::size_t count, std::string_view limit, std::uint64_t bound) {
  if (count < bound) return true;
  if (reading.full.insert(limit).second) {
    tell(reading, at, "limit_exceeded",
         "the limit " + std::string(limit) + " is " + std::to_string(bound) + ", those written in place included");
  }
  return false;
}

/// Patterns that the format has and this build does not: telling that `checker` is missing too would mislead.
bool has_other_pattern(const Fields& fields) {
  return fields.has("file") || fields.has("gradient") || fields.has("noise");
}

tracer::TextureId add_texture(Reading& reading, const Cursor& at) {
  std::vector<tracer::Texture>& textures = reading.scene().textures;
  if (!has_room(reading, at, textures.size(), "textures", reading.limits.scene.textures)) return {nothing};
  const tracer::TextureId id{static_cast<std::uint32_t>(textures.size())};
  tracer::Texture& texture = textures.emplace_back();
  texture.path = pointer(at);
  Fields fields(reading, at, "texture", "a texture");
  auto& checker = texture.pattern.emplace<tracer::CheckerTexture>();
  if (!fields.optional("checker", checker.colors) && !fields.has("checker") && fields && !has_other_pattern(fields)) {
    fields.tell_missing("checker");
  }
  fields.optional("scale", texture.scale);
  fields.optional("offset", texture.offset);
  fields.finish();
  return id;
}

/// A string that does not begin with '#' names a texture, an object without "hsb" is one; all else is a colour.
void read_color_or_texture(Reading& reading, const Cursor& at, tracer::ColorOrTexture& value) {
  if (at.node->kind == json::Kind::string && !at.node->string().starts_with('#')) {
    value = find(reading, at, reading.textures, "textures");
  } else if (at.node->kind == json::Kind::object && !has_member(reading, at, "hsb")) {
    value = add_texture(reading, at);
  } else {
    read(reading, at, value.emplace<tracer::Color>());
  }
}

/// What a material reflects by default depends on whether Fresnel's equations hold, and that on what it transmits.
void read_reflection(Fields& fields, tracer::Material& material) {
  fields.optional("transparency", Word<Transparency>{material.transparency, "material.transparency", transparencies});
  const bool transmits = fields.optional("transmission", material.transmission) && material.transmission > 0;
  material.fresnel = transmits && material.transparency == Transparency::refract;
  fields.optional("fresnel", material.fresnel);
  if (material.fresnel) material.reflection = 1;
  fields.optional("reflection", material.reflection);
}

tracer::MaterialId add_material(Reading& reading, const Cursor& at) {
  std::vector<tracer::Material>& materials = reading.scene().materials;
  if (!has_room(reading, at, materials.size(), "materials", reading.limits.scene.materials)) return {nothing};
  const tracer::MaterialId id{static_cast<std::uint32_t>(materials.size())};
  tracer::Material& material = materials.emplace_back();
  material.path = pointer(at);
  Fields fields(reading, at, "material", "a material");
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
  fields.finish();
  return id;
}

template <class Id>
void read_named(Reading& reading, const Cursor& at, Names<Id>& names, Id (*add)(Reading&, const Cursor&)) {
  names.complete = for_each_member(reading, at, [&](const Cursor& member) {
    const auto [place, is_new] = names.ids.emplace(member.key, Id{});
    if (is_new) {
      place->second = add(reading, member);
    } else {
      tell(reading, member, "duplicate_key", quoted(member.key) + " is defined twice");
    }
  });
}

}  // namespace

void read_textures(Reading& reading, const Cursor& at) {
  reading.textures.complete = within_limit(reading, at, "textures", reading.limits.scene.textures);
  if (reading.textures.complete) read_named(reading, at, reading.textures, add_texture);
}

void read_materials(Reading& reading, const Cursor& at) {
  reading.materials.complete = within_limit(reading, at, "materials", reading.limits.scene.materials);
  if (reading.materials.complete) read_named(reading, at, reading.materials, add_material);
}

tracer::MaterialId read_material_reference(Reading& reading, const Cursor& at) {
  if (at.node->kind == json::Kind::object) return add_material(reading, at);
  if (at.node->kind == json::Kind::string) return find(reading, at, reading.materials, "materials");
  tell_wrong_type(reading, at, "a material's name or a material");
  return {nothing};
}

}  // namespace api
