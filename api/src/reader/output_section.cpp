/// What the image is of and how it is handed over: image, camera, background, depth cue, output.

#include "api/src/reader/fields.h"
#include "api/src/reader/references.h"
#include "api/src/reader/sections.h"

namespace api {
namespace {

using tracer::Camera;
using tracer::Format;
using tracer::Layer;
using Overflow = tracer::Output::Overflow;

constexpr Word<Camera::Type>::Meaning camera_types[] = {{"perspective", Camera::Type::perspective},
                                                        {"orthographic", Camera::Type::orthographic},
                                                        {"panorama", Camera::Type::panorama}};
constexpr Word<Overflow>::Meaning overflows[] = {
    {"clamp", Overflow::clamp}, {"scale", Overflow::scale}, {"reinhard", Overflow::reinhard}};
constexpr Word<Format>::Meaning format_words[] = {
    {"png", Format::png}, {"png16", Format::png16}, {"exr", Format::exr},  {"jpg", Format::jpg},
    {"hdr", Format::hdr}, {"webp", Format::webp},   {"tiff", Format::tiff}};
constexpr Word<Layer>::Meaning layer_words[] = {{"depth", Layer::depth},     {"normal", Layer::normal},
                                                {"albedo", Layer::albedo},   {"object_id", Layer::object_id},
                                                {"samples", Layer::samples}, {"error", Layer::error}};

/// [x0, y0, x1, y1]; unset where it cannot be read.
void read_crop(Reading& reading, const Cursor& at, std::optional<tracer::PixelWindow>& crop) {
  std::uint32_t edges[4] = {};
  if (!expect_length(reading, at, 4)) return;
  bool valid = true;
  for_each_element(reading, at, [&](const Cursor& element) {
    valid &= read(reading, element, Integer<std::uint32_t>{edges[element.index]});
  });
  if (valid) crop = {edges[0], edges[1], edges[2], edges[3]};
}

/// All six faces; unset where it is no object.
void read_cube(Reading& reading, const Cursor& at, std::optional<tracer::CubeMap>& cube) {
  constexpr std::string_view names[] = {"+x", "-x", "+y", "-y", "+z", "-z"};
  Fields fields(reading, at, "a cube");
  if (!fields) return;
  cube.emplace();
  for (std::size_t face = 0; face < 6; ++face) {
    if (const auto field = fields.take(names[face])) {
      cube->faces[face] = read_texture_reference(reading, *field);
    } else {
      fields.report_missing_field(names[face]);
      cube->faces[face] = {invalid_index};
    }
  }
  fields.finish();
}

template <class T>
void read_words(Reading& reading, const Cursor& at, std::string_view scope,
                std::span<const typename Word<T>::Meaning> words, std::vector<T>& values) {
  values.clear();
  for_each_element(reading, at, [&](const Cursor& element) {
    T value{};
    if (read(reading, element, Word<T>{value, scope, words})) values.push_back(value);
  });
}

}  // namespace

void read_image(Reading& reading, const Cursor& at) {
  tracer::ImageSize& image = reading.scene().image;
  Fields fields(reading, at, "the image");
  const bool width = fields.optional("width", Integer<std::uint32_t>{image.width, 1}) || !fields.has("width");
  const bool height = fields.optional("height", Integer<std::uint32_t>{image.height, 1}) || !fields.has("height");
  if (const auto crop = fields.take("crop")) read_crop(reading, *crop, image.crop);
  if (!width || !height) image.crop.reset();  // whether it lies within the image cannot be said
  fields.finish();
}

/// The fields of other types may stay, and mean nothing: changing the type is changing a word.
void read_camera(Reading& reading, const Cursor& at) {
  Camera& camera = reading.scene().camera;
  Fields fields(reading, at, "the camera");
  fields.optional("type", Word<Camera::Type>{camera.type, "camera.type", camera_types});
  fields.required("position", camera.position);
  fields.required("look_at", camera.look_at);
  fields.optional("up", camera.up);
  fields.optional("fov", camera.fov_deg);
  if (camera.type == Camera::Type::orthographic) {
    fields.required("height", camera.height);
  } else {
    fields.optional("height", camera.height);
  }
  fields.optional("aperture", camera.aperture);
  if (const auto distance = fields.take("focus_distance")) read(reading, *distance, camera.focus_distance.emplace());
  fields.finish();
}

void read_background(Reading& reading, const Cursor& at) {
  tracer::Background& background = reading.scene().background;
  Fields fields(reading, at, "the background");
  if (const auto environment = fields.take("environment")) {
    fields.set_kind("a background with an environment");
    background.environment.emplace().texture = read_texture_reference(reading, *environment);
    fields.optional("rotation", background.environment->rotation_deg);
  } else if (const auto cube = fields.take("cube")) {
    fields.set_kind("a background with a cube");
    read_cube(reading, *cube, background.cube);
  } else if (fields.has("zenith") || fields.has("nadir")) {
    fields.set_kind("a background with zenith and nadir");
    tracer::Gradient& gradient = background.gradient.emplace();
    fields.required("zenith", gradient.zenith);
    fields.required("nadir", gradient.nadir);
  } else {
    fields.optional("color", background.color);
  }
  fields.finish();
}

void read_depth_cue(Reading& reading, const Cursor& at) {
  tracer::DepthCue& cue = reading.scene().depth_cue.emplace();
  Fields fields(reading, at, "the depth cue");
  fields.required("front", cue.front);
  fields.required("back", cue.back);
  fields.optional("front_scale", cue.front_scale);
  fields.optional("back_scale", cue.back_scale);
  fields.optional("color", cue.color);
  fields.finish();
}

void read_output(Reading& reading, const Cursor& at) {
  tracer::Output& output = reading.scene().output;
  Fields fields(reading, at, "the output");
  if (const auto formats = fields.take("formats")) {
    read_words<Format>(reading, *formats, "output.formats", format_words, output.formats);
  }
  fields.optional("exposure", output.exposure);
  fields.optional("overflow", Word<Overflow>{output.overflow, "output.overflow", overflows});
  fields.optional("palette", Integer<std::uint32_t>{output.palette, 2, 256});
  if (const auto layers = fields.take("layers")) {
    read_words<Layer>(reading, *layers, "output.layers", layer_words, output.layers);
  }
  fields.optional("alpha", output.alpha);
  fields.finish();
}

}  // namespace api
