/// Textures: named ones in their map, and those written in place.

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "api/src/reader/fields.h"
#include "api/src/reader/named.h"
#include "api/src/reader/references.h"
#include "api/src/reader/sections.h"

namespace api {
namespace {

using Wrap = tracer::Texture::Wrap;
using Filter = tracer::Texture::Filter;
using tracer::ColorSpace;

constexpr Word<Wrap>::Meaning wraps[] = {{"repeat", Wrap::repeat}, {"clamp", Wrap::clamp}, {"mirror", Wrap::mirror}};
constexpr Word<Filter>::Meaning filters[] = {
    {"nearest", Filter::nearest}, {"bilinear", Filter::bilinear}, {"mipmap", Filter::mipmap}};
constexpr Word<ColorSpace>::Meaning color_spaces[] = {{"srgb", ColorSpace::srgb}, {"linear", ColorSpace::linear}};

constexpr std::array<std::string_view, 4> patterns{"checker", "gradient", "noise", "file"};

template <class Pattern>
void read_pair(Fields& fields, tracer::Texture& texture, std::string_view name) {
  fields.optional(name, texture.pattern.emplace<Pattern>().colors);
}

/// The field that is there decides what the texture is, and which fields it has beside the common ones.
void read_pattern(Reading& reading, Fields& fields, tracer::Texture& texture) {
  if (fields.has("checker")) {
    read_pair<tracer::CheckerTexture>(fields, texture, "checker");
  } else if (fields.has("gradient")) {
    read_pair<tracer::GradientTexture>(fields, texture, "gradient");
  } else if (fields.has("noise")) {
    read_pair<tracer::NoiseTexture>(fields, texture, "noise");
    fields.optional("octaves", Integer<std::uint32_t>{std::get<tracer::NoiseTexture>(texture.pattern).octaves, 1});
  } else if (const auto file = fields.take("file")) {
    auto& image = texture.pattern.emplace<tracer::ImageTexture>();
    read_asset(reading, *file, image.file);
    ColorSpace space{};
    if (fields.optional("color_space", Word<ColorSpace>{space, "texture.color_space", color_spaces})) {
      image.color_space = space;
    }
  } else if (fields) {
    fields.report_missing_one_of(patterns);
  }
}

tracer::TextureId add_texture(Reading& reading, const Cursor& at) {
  std::vector<tracer::Texture>& textures = reading.scene().textures;
  if (!has_capacity(reading, at, textures.size(), "textures", reading.limits.scene.textures)) return {invalid_index};
  const tracer::TextureId id{static_cast<std::uint32_t>(textures.size())};
  tracer::Texture& texture = textures.emplace_back();
  texture.path = pointer(at);
  Fields fields(reading, at, "a texture");
  read_pattern(reading, fields, texture);
  fields.optional("scale", texture.scale);
  fields.optional("offset", texture.offset);
  fields.optional("wrap", Word<Wrap>{texture.wrap, "texture.wrap", wraps});
  fields.optional("filter", Word<Filter>{texture.filter, "texture.filter", filters});
  fields.finish();
  return id;
}

}  // namespace

tracer::TextureId read_texture_reference(Reading& reading, const Cursor& at) {
  if (at.node->kind == json::Kind::object) return add_texture(reading, at);
  if (at.node->kind == json::Kind::string) return find(reading, at, reading.textures, "textures");
  add_wrong_type(reading, at, "a texture's name or a texture");
  return {invalid_index};
}

/// A string that does not begin with '#' names a texture, an object without "hsb" is one; all else is a colour.
void read_color_or_texture(Reading& reading, const Cursor& at, tracer::ColorOrTexture& value) {
  if (at.node->kind == json::Kind::string && !at.node->string().starts_with('#')) {
    value = read_texture_reference(reading, at);
  } else if (at.node->kind == json::Kind::object && !has_member(reading, at, "hsb")) {
    value = add_texture(reading, at);
  } else {
    read(reading, at, value.emplace<tracer::Color>());
  }
}

void read_textures(Reading& reading, const Cursor& at) {
  reading.textures.complete = within_limit(reading, at, "textures", reading.limits.scene.textures);
  if (reading.textures.complete) read_named(reading, at, reading.textures, add_texture);
}

}  // namespace api
