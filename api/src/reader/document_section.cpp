#include <string>

#include "api/src/reader/fields.h"
#include "api/src/reader/sections.h"

namespace api {
namespace {

// Fields of which this build has one choice only: what the document means when it writes the default out.
enum class Projection { perspective };
enum class Overflow { clamp };

constexpr Word<Projection>::Meaning projections[] = {{"perspective", Projection::perspective}};
constexpr Word<Overflow>::Meaning overflows[] = {{"clamp", Overflow::clamp}};
constexpr Word<tracer::Format>::Meaning format_words[] = {{"png", tracer::Format::png}, {"exr", tracer::Format::exr}};

/// A document of another version is not read further: what it means is unknown.
bool read_version(Reading& reading, Fields& fields) {
  const auto field = fields.take("version");
  if (!field) {
    fields.tell_missing("version");
    return true;
  }
  double version = 0;
  if (!read(reading, *field, version) || version == 1) return true;
  tell(reading, *field, "out_of_range", "must be 1, the version this build reads; got " + number_text(version));
  return false;
}

void read_image(Reading& reading, const Cursor& at) {
  tracer::ImageSize& image = reading.scene().image;
  Fields fields(reading, at, "image", "the image");
  fields.optional("width", Integer<std::uint32_t>{image.width, 1});
  fields.optional("height", Integer<std::uint32_t>{image.height, 1});
  fields.finish();
}

void read_camera(Reading& reading, const Cursor& at) {
  tracer::Camera& camera = reading.scene().camera;
  Fields fields(reading, at, "camera", "the camera");
  Projection type{};
  fields.optional("type", Word<Projection>{type, "camera.type", projections});
  fields.required("position", camera.position);
  fields.required("look_at", camera.look_at);
  fields.optional("up", camera.up);
  fields.optional("fov", camera.fov_deg);
  fields.finish();
}

void read_background(Reading& reading, const Cursor& at) {
  Fields fields(reading, at, "background", "the background");
  fields.optional("color", reading.scene().background.color);
  fields.finish();
}

/// [n, n]: exactly n. A range is a promise to sample adaptively, which this build cannot keep.
void read_samples(Reading& reading, const Cursor& at, std::uint32_t& samples) {
  std::uint32_t range[2] = {samples, samples};
  if (!expect_length(reading, at, 2)) return;
  bool well = true;
  for_each_element(reading, at, [&](const Cursor& element) {
    well &= read(reading, element, Integer<std::uint32_t>{range[element.index], 1});
  });
  if (!well) return;
  if (range[0] > range[1]) {
    tell(reading, at, "out_of_range", "the minimum must not be above the maximum");
  } else if (range[0] < range[1]) {
    tell(reading, at, "unsupported",
         "this build takes the same number of samples in every pixel: write [n, n], the minimum equal to the maximum");
  } else {
    samples = range[0];
  }
}

void read_accuracy(Reading& reading, const Cursor& at) {
  tracer::Accuracy& accuracy = reading.scene().accuracy;
  Fields fields(reading, at, "accuracy", "the accuracy");
  if (const auto samples = fields.take("samples")) read_samples(reading, *samples, accuracy.samples);
  fields.optional("max_depth", Integer<std::uint32_t>{accuracy.max_depth});
  fields.optional("cutoff", accuracy.cutoff);
  fields.optional("seed", Integer<std::uint64_t>{accuracy.seed});
  fields.finish();
}

void read_output(Reading& reading, const Cursor& at) {
  std::vector<tracer::Format>& formats = reading.scene().output.formats;
  Overflow overflow{};
  Fields fields(reading, at, "output", "the output");
  if (const auto field = fields.take("formats")) {
    formats.clear();
    for_each_element(reading, *field, [&](const Cursor& element) {
      tracer::Format format{};
      if (read(reading, element, Word<tracer::Format>{format, "output.formats", format_words})) {
        formats.push_back(format);
      }
    });
  }
  fields.optional("overflow", Word<Overflow>{overflow, "output.overflow", overflows});
  fields.finish();
}

}  // namespace

bool read_document(Reading& reading, const Cursor& at) {
  using Section = void (*)(Reading&, const Cursor&);
  Fields fields(reading, at, "document", "the document");
  const auto section = [&](std::string_view name, Section read_section) {
    const auto field = fields.take(name);
    if (field) read_section(reading, *field);
    return field.has_value();
  };
  if (!fields || !read_version(reading, fields)) return false;
  fields.optional("name", Name{reading.scene().name});
  section("image", read_image);
  if (!section("camera", read_camera)) fields.tell_missing("camera");
  section("background", read_background);
  fields.optional("ambient", reading.scene().ambient);
  section("lights", read_lights);
  section("textures", read_textures);
  section("materials", read_materials);
  section("prototypes", read_prototypes);
  section("objects", read_objects);
  section("accuracy", read_accuracy);
  section("output", read_output);
  reading.document.job.name = reading.scene().name;
  section("job", read_job);
  fields.finish();
  return true;
}

}  // namespace api
