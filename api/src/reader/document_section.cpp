#include <string>

#include "api/src/reader/fields.h"
#include "api/src/reader/sections.h"

namespace api {
namespace {

/// A document of another version is not read further: what it means is unknown.
bool read_version(Reading& reading, Fields& fields) {
  const auto field = fields.take("version");
  if (!field) {
    fields.report_missing_field("version");
    return true;
  }
  double version = 0;
  if (!read(reading, *field, version) || version == 1) return true;
  add_issue(reading, *field, "out_of_range", "must be 1, the version this build reads; got " + number_text(version));
  return false;
}

}  // namespace

bool read_document(Reading& reading, const Cursor& at) {
  using Section = void (*)(Reading&, const Cursor&);
  Fields fields(reading, at, "the document");
  const auto section = [&](std::string_view name, Section read_section) {
    const auto field = fields.take(name);
    if (field) read_section(reading, *field);
    return field.has_value();
  };
  if (!fields || !read_version(reading, fields)) return false;
  fields.optional("name", Name{reading.scene().name});
  section("image", read_image);
  if (!section("camera", read_camera)) fields.report_missing_field("camera");
  section("depth_cue", read_depth_cue);
  fields.optional("ambient", reading.scene().ambient);
  section("lights", read_lights);
  section("textures", read_textures);
  section("background", read_background);
  section("materials", read_materials);
  section("prototypes", read_prototypes);
  section("objects", read_objects);
  section("output", read_output);
  read_accuracy(reading, fields.take("accuracy"));  // behind the image and the output, whose size and exposure it asks
  reading.document.job.name = reading.scene().name;
  section("job", read_job);
  fields.finish();
  return true;
}

}  // namespace api
