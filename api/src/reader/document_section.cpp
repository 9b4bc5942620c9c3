#include <string>

#include "api/src/reader/fields.h"
#include "api/src/reader/sections.h"

namespace api {
namespace {

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
  section("depth_cue", read_depth_cue);
  fields.optional("ambient", reading.scene().ambient);
  section("lights", read_lights);
  section("textures", read_textures);
  section("background", read_background);
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
