#include <string>

#include "api/src/reader/fields.h"
#include "api/src/reader/issue_text.h"
#include "api/src/reader/sections.h"

namespace api {
namespace {

/// A document of another version is not read further: its meaning is unknown.
bool read_version(Reading& reading, Fields& fields) {
  const auto field = fields.take_required("version");
  double version = 0;
  if (!field || !read(reading, *field, version) || version == 1) return true;
  return add_issue(reading, *field, "out_of_range",
                   "must be 1, the version this build reads; got " + number_text(version));
}

}  // namespace

bool read_document(Reading& reading, const Cursor& at) {
  tracer::Scene& scene = reading.scene();
  Fields fields(reading, at, "the document");
  const auto section = [&](std::string_view name, void (*read_section)(Reading&, const Cursor&)) {
    if (const auto field = fields.take(name)) read_section(reading, *field);
  };
  if (!fields || !read_version(reading, fields)) return false;
  fields.optional("name", Name{scene.name});
  section("image", read_image);
  if (const auto camera = fields.take_required("camera")) read_camera(reading, *camera);
  section("depth_cue", read_depth_cue);
  fields.optional("ambient", scene.ambient);
  section("lights", read_lights);
  section("textures", read_textures);
  section("background", read_background);
  section("materials", read_materials);
  section("prototypes", read_prototypes);
  section("objects", read_objects);
  section("output", read_output);
  read_accuracy(reading, fields.take("accuracy"));  // depends on the image's size
  reading.document.job.name = scene.name;
  section("job", read_job);
  fields.finish();
  return true;
}

}  // namespace api
