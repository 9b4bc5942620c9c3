/// Materials, textures (both named in their map, or written in place) and the names of files.

#include <array>
#include <string>
#include <string_view>
#include <tuple>
#include <variant>
#include <vector>

#include "api/reader/fields.h"
#include "api/reader/issue_text.h"
#include "api/src/reader/color_names.h"
#include "api/src/reader/sections.h"
#include "tracer/sha256.h"

namespace api {

namespace {

constexpr std::size_t asset_name_bytes = 4096;  // PATH_MAX

/// True if each part between slashes is the plain name of a file or directory.
bool stays_below_directory(std::string_view path) {
  if (path.find('\\') != std::string_view::npos) return false;
  while (true) {
    const std::size_t slash = path.find('/');
    const std::string_view name = path.substr(0, slash);
    if (name.empty() || name == "." || name == "..") return false;
    if (slash == std::string_view::npos) return true;
    path.remove_prefix(slash + 1);
  }
}

bool is_upload_name(Reading& reading, const Cursor& at, std::string_view name) {
  if (!tracer::is_sha256(name.substr(upload_prefix.size())))
    return add_issue(reading, at, "malformed", "must be sha256: and 64 lower-case hex digits, got " + quoted(name));
  return reading.limits.uploads ||
         add_issue(reading, at, "unsupported",
                   "files named by hash are available only from a service that accepts uploads; name a file instead");
}

bool is_asset_name(Reading& reading, const Cursor& at, std::string_view name) {
  if (name.starts_with(upload_prefix)) return is_upload_name(reading, at, name);
  if (reading.limits.files == Files::none)
    return add_issue(reading, at, "unsupported",
                     "this service has no directory of files: it was started without the option --assets DIRECTORY. "
                     "Upload the file and name it by its hash");
  if (name.empty() || has_control_characters(name))
    return add_issue(reading, at, "malformed", "must be the relative path of a file, got " + quoted(name));
  if (name.size() > asset_name_bytes)
    return add_limit_exceeded(reading, at, "asset_name_bytes", asset_name_bytes, name.size());
  if (reading.limits.files == Files::below_a_directory && !stays_below_directory(name))
    return add_issue(reading, at, "malformed",
                     "must be a path below the asset directory, of plain names between slashes (no \"..\", \".\" or "
                     "backslash), got " +
                         quoted(name));
  return true;
}

/// The texture's pattern follows from the first of its fields, and its other fields from the pattern.
template <class... Patterns>
void read_pattern(Fields& fields, std::variant<Patterns...>& pattern) {
  constexpr std::array names{std::get<0>(Patterns::fields()).name...};
  std::size_t kind = 0;
  while (kind < names.size() && !fields.has(names[kind])) ++kind;
  read_alternative(pattern, kind, [&](auto& present) { read_all_fields(fields, present); });
  if (kind < names.size()) return;
  fields.report_missing_one_of(names);
  for (const std::string_view name : names) fields.take(name);
}

/// `s` stands for `[s, s]`.
void read_scale(Reading& reading, const Cursor& at, tracer::Vec2& scale) {
  if (at.node->kind != json::Kind::number) {
    read(reading, at, scale);
  } else if (read(reading, at, scale.x)) {
    scale.y = scale.x;
  }
}

tracer::TextureId add_texture(Reading& reading, const Cursor& at) {
  std::vector<tracer::Texture>& textures = reading.scene().textures;
  if (!has_capacity(reading, at, textures.size(), "textures", reading.limits.scene.textures)) return {invalid_index};
  const tracer::TextureId id{static_cast<std::uint32_t>(textures.size())};
  tracer::Texture& texture = textures.emplace_back();
  texture.path = pointer(at);
  Fields fields(reading, at, "a texture");
  read_pattern(fields, texture.pattern);
  if (const auto scale = fields.take("scale")) read_scale(reading, *scale, texture.scale);
  tracer::for_each_field<tracer::Texture>([&](const auto& field) {
    if (field.name != "scale") read_field(fields, field, texture);
  });
  fields.finish();
  return id;
}

/// Fields that only one kind of models has: none is without effect in silence.
void check_fields_of_model(Fields& fields, const tracer::Material& material) {
  const bool principled = material.model == tracer::Material::Model::principled;
  for (const std::string_view name : tracer::Material::local_fields)
    if (principled && fields.has(name))
      fields.add_issue(name, "conflict", R"(has no effect where "model" is "principled")");
  if (principled && material.transparency == tracer::Material::Transparency::interpolated)
    fields.add_issue("transparency", "conflict", R"(must be "refract" or "filtered" where "model" is "principled")");
  for (const std::string_view name : tracer::Material::principled_fields)
    if (!principled && fields.has(name)) fields.add_issue(name, "conflict", R"(needs "model": "principled")");
}

/// The default of `reflection` depends on `fresnel`, whose default depends on the transmission. Principled glass has
/// them, too.
void set_derived_fields(const Fields& fields, tracer::Material& material) {
  if (material.model == tracer::Material::Model::principled && !fields.has("specular")) material.specular = 1;
  if (!fields.has("fresnel"))
    material.fresnel = material.transmission > 0 && material.transparency == tracer::Material::Transparency::refract;
  if (!fields.has("reflection") && material.fresnel) material.reflection = 1;
}

tracer::MaterialId add_material(Reading& reading, const Cursor& at) {
  std::vector<tracer::Material>& materials = reading.scene().materials;
  if (!has_capacity(reading, at, materials.size(), "materials", reading.limits.scene.materials)) return {invalid_index};
  const tracer::MaterialId id{static_cast<std::uint32_t>(materials.size())};
  tracer::Material& material = materials.emplace_back();
  material.path = pointer(at);
  Fields fields(reading, at, "a material");
  read_all_fields(fields, material);
  check_fields_of_model(fields, material);
  set_derived_fields(fields, material);
  fields.finish();
  return id;
}

/// Neither a texture's name nor a color's.
bool add_unknown_color(Reading& reading, const Cursor& at, tracer::ColorOrTexture& value) {
  set_invalid(value.emplace<tracer::Color>());
  if (!reading.can_add_issue()) return false;
  std::vector<std::string_view> names = color_names();
  for (const auto& [name, id] : reading.textures.ids) names.push_back(name);
  return add_issue(reading, at, "unknown_reference",
                   quoted(at.node->string()) + " is no texture's name and no colour (\"red\", \"#rrggbb\", [r, g, b])" +
                       did_you_mean(at.node->string(), names));
}

}  // namespace

bool read(Reading& reading, const Cursor& at, tracer::AssetId& asset) {
  if (!expect_string(reading, at, "the relative path of a file")) return false;
  const std::string_view name = at.node->string();
  if (!is_asset_name(reading, at, name)) return false;
  std::vector<tracer::Asset>& assets = reading.scene().assets;
  const auto [place, is_new] =
      reading.assets.ids.emplace(name, tracer::AssetId{static_cast<std::uint32_t>(assets.size())});
  if (is_new) assets.push_back({std::string(name), pointer(at)});
  asset = place->second;
  return true;
}

bool read(Reading& reading, const Cursor& at, tracer::TextureId& texture) {
  set_invalid(texture);
  if (at.node->kind == json::Kind::string) return find_name(reading, at, reading.textures, "textures", texture);
  if (at.node->kind != json::Kind::object) return add_wrong_type(reading, at, "a texture's name or a texture");
  texture = add_texture(reading, at);
  return true;
}

/// A string that is the name of a texture, or of no color, names a texture, and an object without "hsb" is one; all
/// else is a color.
bool read(Reading& reading, const Cursor& at, tracer::ColorOrTexture& value) {
  const std::string_view text = at.node->kind == json::Kind::string ? at.node->string() : "#";
  const bool is_name = !text.starts_with('#') && (reading.textures.ids.contains(text) || !color_by_name(text));
  if (is_name && reading.textures.complete && !reading.textures.ids.contains(text))
    return add_unknown_color(reading, at, value);
  const bool is_texture = at.node->kind == json::Kind::object && reading.tape.find_key(at.node, "hsb") == nullptr;
  if (is_name || is_texture) return read(reading, at, value.emplace<tracer::TextureId>());
  return read(reading, at, value.emplace<tracer::Color>());
}

void read_textures(Reading& reading, const Cursor& at) {
  reading.textures.complete = within_limit(reading, at, "textures", reading.limits.scene.textures) &&
                              read_names(reading, at, reading.textures.ids, add_texture);
}

void read_materials(Reading& reading, const Cursor& at) {
  reading.materials.complete = within_limit(reading, at, "materials", reading.limits.scene.materials) &&
                               read_names(reading, at, reading.materials.ids, add_material);
}

bool read(Reading& reading, const Cursor& at, tracer::MaterialId& material) {
  set_invalid(material);
  if (at.node->kind == json::Kind::string) return find_name(reading, at, reading.materials, "materials", material);
  if (at.node->kind != json::Kind::object) return add_wrong_type(reading, at, "a material's name or a material");
  material = add_material(reading, at);
  return true;
}

}  // namespace api
