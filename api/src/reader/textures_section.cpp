/// Textures: named ones in their map, and those written in place.

#include <array>
#include <string_view>
#include <vector>

#include "api/src/reader/fields.h"
#include "api/src/reader/names.h"
#include "api/src/reader/sections.h"

namespace api {

using Wrap = tracer::Texture::Wrap;
using Filter = tracer::Texture::Filter;
using ColorSpace = tracer::ColorSpace;

template <>
inline constexpr Word<Wrap> words<Wrap>[] = {
    {"repeat", Wrap::repeat}, {"clamp", Wrap::clamp}, {"mirror", Wrap::mirror}};
template <>
inline constexpr Word<Filter> words<Filter>[] = {
    {"nearest", Filter::nearest}, {"bilinear", Filter::bilinear}, {"mipmap", Filter::mipmap}};
template <>
inline constexpr Word<ColorSpace> words<ColorSpace>[] = {{"srgb", ColorSpace::srgb}, {"linear", ColorSpace::linear}};

namespace {

constexpr std::array<std::string_view, 4> patterns{"checker", "gradient", "noise", "file"};

template <class Pattern>
Pattern& read_pattern(Fields& fields, tracer::Texture& texture, std::string_view name) {
  auto& pattern = texture.pattern.emplace<Pattern>();
  fields.optional(name, pattern.colors);
  return pattern;
}

/// The texture's kind follows from the field that is present, and its other fields from the kind.
void read_pattern(Fields& fields, tracer::Texture& texture) {
  if (fields.has("checker")) {
    read_pattern<tracer::CheckerTexture>(fields, texture, "checker");
  } else if (fields.has("gradient")) {
    read_pattern<tracer::GradientTexture>(fields, texture, "gradient");
  } else if (fields.has("noise")) {
    auto& noise = read_pattern<tracer::NoiseTexture>(fields, texture, "noise");
    fields.optional("octaves", Integer<std::uint32_t>{noise.octaves, 1});
  } else if (fields.has("file")) {
    auto& image = texture.pattern.emplace<tracer::ImageTexture>();
    fields.optional("file", image.file);
    fields.optional("color_space", image.color_space);
  } else {
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
  read_pattern(fields, texture);
  fields.optional("scale", texture.scale);
  fields.optional("offset", texture.offset);
  fields.optional("wrap", texture.wrap);
  fields.optional("filter", texture.filter);
  fields.finish();
  return id;
}

}  // namespace

bool read(Reading& reading, const Cursor& at, tracer::TextureId& texture) {
  set_invalid(texture);
  if (at.node->kind == json::Kind::string) return find_name(reading, at, reading.textures, "textures", texture);
  if (at.node->kind != json::Kind::object) return add_wrong_type(reading, at, "a texture's name or a texture");
  texture = add_texture(reading, at);
  return true;
}

/// A string that does not begin with '#' names a texture, and an object without "hsb" is one; all else is a color.
bool read(Reading& reading, const Cursor& at, tracer::ColorOrTexture& value) {
  const bool is_name = at.node->kind == json::Kind::string && !at.node->string().starts_with('#');
  const bool is_texture = at.node->kind == json::Kind::object && reading.tape.find_key(at.node, "hsb") == nullptr;
  if (is_name || is_texture) return read(reading, at, value.emplace<tracer::TextureId>());
  return read(reading, at, value.emplace<tracer::Color>());
}

void read_textures(Reading& reading, const Cursor& at) {
  reading.textures.complete = within_limit(reading, at, "textures", reading.limits.scene.textures);
  if (reading.textures.complete) read_names(reading, at, reading.textures, add_texture);
}

}  // namespace api
