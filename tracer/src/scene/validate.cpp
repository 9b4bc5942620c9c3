#include "tracer/validate.h"

#include <algorithm>
#include <set>
#include <string>
#include <type_traits>
#include <variant>

#include "tracer/encode.h"
#include "tracer/src/lights/light_registry.h"
#include "tracer/src/materials/compiled_material.h"
#include "tracer/src/scene/checks.h"
#include "tracer/src/scene/color_bound.h"
#include "tracer/src/textures/texture.h"

namespace tracer {
namespace {

bool check_crop(Checks& checks, const DocumentPath& where, const ImageSize& image) {
  const PixelWindow& crop = *image.crop;
  const auto span = [&](std::size_t first, std::uint32_t begin, std::uint32_t end, std::uint32_t side) {
    if (end > side)
      return checks.add_issue({where, first + 2}, "out_of_range",
                              "must be <= " + std::to_string(side) + ", got " + std::to_string(end));
    return begin < end || checks.add_issue({where, first + 2}, "out_of_range",
                                           "must be > " + std::to_string(begin) + ", got " + std::to_string(end));
  };
  const bool columns = span(0, crop.x0, crop.x1, image.width);
  const bool rows = span(1, crop.y0, crop.y1, image.height);
  return columns && rows;
}

void check_image(Checks& checks, const ImageSize& image) {
  const DocumentPath where("/image");
  const auto side = [&](std::string_view name, std::uint32_t pixels) {
    const DocumentPath place(where, name);
    if (pixels == 0) return checks.add_issue(place, "out_of_range", "must be >= 1, got 0");
    return checks.count(place, pixels, checks.limits.image_side, "image_side");
  };
  const bool width = side("width", image.width);
  const bool height = side("height", image.height);
  if (width && height) {
    if (image.crop && !check_crop(checks, {where, "crop"}, image)) return;
    checks.count(where, image.window().pixels(), checks.limits.pixels, "pixels");
  }
}

void check_camera(Checks& checks, const Camera& camera) {
  const DocumentPath where("/camera");
  FieldChecks fields(checks, where);
  fields.ranges(camera, "fov");
  const Vec3 view = camera.look_at - camera.position;
  if (fields.apart("look_at", camera.look_at, camera.position,
                   "must not be the position: the camera has no direction") &&
      fields.is_direction(camera.up) && parallel(view, camera.up))
    checks.add_issue({where, "up"}, "degenerate", "must not be parallel to the view from position to look_at");
  const DocumentPath fov(where, "fov");
  if (checks.finite(fov, camera.fov_deg) && (camera.fov_deg <= 0 || camera.fov_deg >= 180))
    checks.add_issue(fov, "out_of_range", "must be > 0 and < 180 degrees, got " + text_of(camera.fov_deg));
}

/// Rules of stereo pairs with other parts of the scene.
void check_layout(Checks& checks, const Scene& scene) {
  using Layout = Camera::Layout;
  const Camera& camera = scene.camera;
  if (camera.layout == Layout::single) return;
  // The document may leave out the layout where there is a distance.
  const DocumentPath where(camera.eye_separation > 0 ? "/camera/eye_separation" : "/camera/layout");
  if (camera.type == Camera::Type::panorama)
    checks.add_issue(where, "conflict", "a stereo pair needs a perspective or an orthographic camera");
  if (scene.image.crop) checks.add_issue(where, "conflict", "a stereo pair has no \"crop\"");
  if (camera.layout == Layout::side_by_side && scene.image.width % 2 != 0)
    checks.add_issue(DocumentPath("/image/width"), "conflict",
                     "must be even for two images side by side, got " + std::to_string(scene.image.width));
  if (camera.layout == Layout::anaglyph && (scene.depth_cue || scene.output.alpha || !scene.output.layers.empty()))
    checks.add_issue(where, "conflict",
                     "an anaglyph has two surfaces at each pixel: it has no \"depth_cue\", \"layers\" or \"alpha\"");
}

void check_background(Checks& checks, const Background& background) {
  const DocumentPath where("/background");
  FieldChecks fields(checks, where);
  checks.color({where, "color"}, background.color);
  if (background.up) checks.direction({where, "up"}, *background.up);
  if (background.gradient) fields.ranges(*background.gradient);
  if (background.environment) fields.ranges(*background.environment);
  if (!background.cube) return;
  constexpr std::string_view faces[] = {"+x", "-x", "+y", "-y", "+z", "-z"};
  const DocumentPath cube(where, "cube");
  for (std::size_t face = 0; face < 6; ++face) checks.texture({cube, faces[face]}, background.cube->faces[face]);
}

void check_depth_cue(Checks& checks, const DepthCue& cue) {
  const DocumentPath where("/depth_cue");
  FieldChecks(checks, where).ranges(cue);
  if (cue.back < cue.front && cue.back >= -checks.limits.coordinate_max && cue.front <= checks.limits.coordinate_max)
    checks.add_issue({where, "back"}, "out_of_range",
                     "must be >= front " + text_of(cue.front) + ", got " + text_of(cue.back));
}

void check_lights(Checks& checks, const std::vector<Light>& lights) {
  const DocumentPath where("/lights");
  checks.count(where, lights.size(), checks.limits.lights, "lights");
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const DocumentPath light(where, i);
    FieldChecks fields(checks, light);
    std::visit(
        [&](const auto& source) {
          fields.ranges(source);
          LightTraits<std::decay_t<decltype(source)>>::check(fields, source);
        },
        lights[i].source);
    fields.ranges(lights[i]);
  }
}

void check_textures(Checks& checks, const Scene& scene) {
  if (scene.assets.size() > checks.limits.assets)
    checks.count(DocumentPath(scene.assets[checks.limits.assets].path), scene.assets.size(), checks.limits.assets,
                 "assets");
  checks.count(DocumentPath("/textures"), scene.textures.size(), checks.limits.textures, "textures");
  for (const Texture& texture : scene.textures) {
    const DocumentPath where(texture.path);
    FieldChecks fields(checks, where);
    std::visit([&](const auto& pattern) { fields.ranges(pattern); }, texture.pattern);
    fields.ranges(texture);
    if (const auto* noise = std::get_if<NoiseTexture>(&texture.pattern))
      checks.count({where, "octaves"}, noise->octaves, checks.limits.octaves, "octaves");
  }
}

void check_share(Checks& checks, const DocumentPath& where, const ColorOrTexture& share) {
  const auto* plain = std::get_if<Color>(&share);
  if (plain != nullptr && max_component(*plain) > 1)
    checks.add_issue(where, "out_of_range", "must be <= 1, got " + text_of(max_component(*plain)));
}

void check_opacity(Checks& checks, const DocumentPath& where, const Material& material) {
  check_share(checks, where, material.opacity);
  const bool refracts = material.transmission > 0 && material.transparency == Material::Transparency::refract;
  if (is_cut_out(material) && (refracts || material.fresnel))
    checks.add_issue(
        where, "conflict",
        std::string("must be 1 where ") +
            (refracts ? "the material refracts; \"transparency\": \"filtered\" does not" : "\"fresnel\" is true"));
}

void check_material(Checks& checks, const Material& material) {
  const DocumentPath where(material.path);
  FieldChecks(checks, where).ranges(material, "transmission");
  if (material.transparency == Material::Transparency::filtered) {
    checks.not_negative({where, "transmission"}, material.transmission);
  } else {
    checks.within({where, "transmission"}, material.transmission, 0, 1);
  }
  check_opacity(checks, {where, "opacity"}, material);
  check_share(checks, {where, "metallic"}, material.metallic);
  check_share(checks, {where, "roughness"}, material.roughness);
}

void check_materials(Checks& checks, const Scene& scene) {
  checks.count(DocumentPath("/materials"), scene.materials.size(), checks.limits.materials, "materials");
  for (const Material& material : scene.materials) check_material(checks, material);
}

/// Materials that an object or an instance names.
std::set<std::uint32_t> named_materials(const Scene& scene) {
  std::set<std::uint32_t> named;
  const auto add = [&](const std::vector<Object>& objects) {
    for (const Object& object : objects) {
      const auto* instance = std::get_if<Instance>(&object.shape);
      if (instance == nullptr) named.insert(object.material.index);
      if (instance != nullptr && instance->material) named.insert(instance->material->index);
    }
  };
  add(scene.objects);
  for (const Prototype& prototype : scene.prototypes) add(prototype.objects);
  return named;
}

/// Image files are not read yet: they count as black, and compile() checks them.
void check_energy(Checks& checks, const Scene& scene) {
  if (scene.accuracy.model != Accuracy::Model::global) return;
  const auto bound_of = [&](const ColorOrTexture& color) { return bound_before_reading(scene, color, 0); };
  for (const std::uint32_t index : named_materials(scene)) {
    if (index >= scene.materials.size()) continue;  // reported where it is named
    const Material& material = scene.materials[index];
    if (const auto excess = excess_of_light(material, bound_of))
      checks.add_issue(DocumentPath(material.path), "out_of_range", *excess);
  }
}

void check_target_error(Checks& checks, const DocumentPath& where, double target) {
  constexpr double levels_max = 255;  // white for black
  if (checks.finite(where, target) && (target <= 0 || target > levels_max))
    checks.add_issue(where, "out_of_range", "must be > 0 and <= 255 levels, got " + text_of(target));
}

void check_adaptive(Checks& checks, const DocumentPath& accuracy, const Adaptive& adaptive) {
  const DocumentPath budget(accuracy, "time_budget_ms");
  if (adaptive.time_budget_ms && checks.finite(budget, *adaptive.time_budget_ms))
    checks.positive(budget, *adaptive.time_budget_ms);
  if (adaptive.samples_min > adaptive.samples_max)
    checks.add_issue({accuracy, "samples"}, "out_of_range", "the minimum must not be above the maximum");
}

/// Checks the minimum number of samples of every pixel; adaptive sampling may take more.
void check_samples(Checks& checks, const DocumentPath& where, const Accuracy& accuracy, std::uint64_t pixels) {
  const std::uint32_t samples = accuracy.adaptive ? accuracy.adaptive->samples_min : accuracy.samples;
  if (samples == 0) {
    checks.add_issue(where, "out_of_range", "must be >= 1, got 0");
  } else if (pixels > 0 && samples > checks.limits.samples_times_pixels / pixels) {
    checks.over(where, "samples_times_pixels", std::to_string(checks.limits.samples_times_pixels),
                std::to_string(samples) + " times " + std::to_string(pixels) + " pixels");
  }
}

void check_accuracy(Checks& checks, const Accuracy& accuracy, const ImageSize& image) {
  const DocumentPath where("/accuracy");
  if (accuracy.target()) check_target_error(checks, {where, "target_error"}, *accuracy.target());
  if (accuracy.tile_target()) check_target_error(checks, {where, "tile_error"}, *accuracy.tile_target());
  if (accuracy.adaptive) check_adaptive(checks, where, *accuracy.adaptive);
  check_samples(checks, {where, "samples"}, accuracy, image.window().pixels());
  if (accuracy.max_depth) checks.count({where, "max_depth"}, *accuracy.max_depth, checks.limits.max_depth, "max_depth");
  FieldChecks(checks, where).ranges(accuracy);
  if (accuracy.model == Accuracy::Model::whitted &&
      accuracy.approximate.interreflection != Approximations::Interreflection::exact)
    checks.add_issue({{where, "approximate"}, "interreflection"}, "conflict",
                     "approximates light that the model does not have: /accuracy/model is whitted");
  const std::uint32_t nearest = accuracy.approximate.nearest_lights;
  if (nearest > nearest_lights_max)
    checks.add_issue(
        {{where, "approximate"}, "lights"}, "out_of_range",
        "must be at most nearest-" + std::to_string(nearest_lights_max) + ", got " + std::to_string(nearest));
}

void check_output(Checks& checks, const Output& output, const PixelWindow& window) {
  const DocumentPath where("/output");
  const DocumentPath formats(where, "formats");
  if (output.formats.empty()) checks.add_issue(formats, "wrong_length", "must name at least one format");
  FieldChecks(checks, where).ranges(output, output.palette == 0 ? "palette" : "");
  const std::uint32_t side = std::max(window.width(), window.height());
  for (std::size_t i = 0; i < output.formats.size(); ++i) {
    const Format format = output.formats[i];
    if (side > row(format).side_max)
      checks.add_issue({formats, i}, "conflict",
                       "a " + std::string(name(format)) + " file has at most " + std::to_string(row(format).side_max) +
                           " pixels on a side, the image " + std::to_string(side));
  }
}

}  // namespace

std::vector<Issue> validate(const Scene& scene, const Limits& limits,
                            const std::function<bool(const Issue&)>& is_reported) {
  Checks checks(scene, limits, is_reported);
  check_image(checks, scene.image);
  check_camera(checks, scene.camera);
  check_layout(checks, scene);
  check_background(checks, scene.background);
  if (scene.depth_cue) check_depth_cue(checks, *scene.depth_cue);
  FieldChecks(checks, DocumentPath("/medium")).ranges(scene.medium);
  checks.color(DocumentPath("/ambient"), scene.ambient);
  check_lights(checks, scene.lights);
  check_energy(checks, scene);
  check_textures(checks, scene);
  check_materials(checks, scene);
  check_objects(checks, scene);
  check_accuracy(checks, scene.accuracy, scene.image);
  check_output(checks, scene.output, scene.image.window());
  return checks.take();
}

}  // namespace tracer
