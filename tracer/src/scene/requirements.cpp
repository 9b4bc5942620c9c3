#include "tracer/requirements.h"

#include <optional>
#include <utility>

#include "tracer/src/scene/placement.h"

namespace tracer {
namespace {

bool has_normals(const Shape& shape) {
  if (const auto* mesh = std::get_if<Mesh>(&shape)) return mesh->smooth || !mesh->normals.empty();
  if (const auto* triangle = std::get_if<Triangle>(&shape)) return triangle->normals.has_value();
  return false;
}

bool is_quadric(const Shape& shape) {
  return std::holds_alternative<Disc>(shape) || std::holds_alternative<Cylinder>(shape) ||
         std::holds_alternative<Cone>(shape) || std::holds_alternative<Box>(shape);
}

bool is_soft(const LightSource& source) {
  return !std::holds_alternative<PointLight>(source) && !std::holds_alternative<DirectionalLight>(source) &&
         !std::holds_alternative<SpotLight>(source);
}

/// Collects needs and the first reason for each.
class Finder {
 public:
  Finder(const Scene& scene, std::vector<RequirementReason>* reasons) : scene_(scene), reasons_(reasons) {}

  Requirements find() {
    const bool several_samples = scene_.accuracy.samples > 1 || scene_.accuracy.adaptive;
    need(&Requirements::lens, scene_.camera.aperture > 0 && several_samples, "/camera/aperture");
    need(&Requirements::depth_cue, scene_.depth_cue.has_value(), "/depth_cue");
    need(&Requirements::layers, !scene_.output.layers.empty(), "/output/layers");
    need(&Requirements::layers, scene_.output.alpha, "/output/alpha");
    look_at(scene_.background);
    for (std::size_t i = 0; i < scene_.lights.size(); ++i) {
      if (scene_.lights[i].shadows && !caster_) caster_ = i;
      need(&Requirements::soft_lights, is_soft(scene_.lights[i].source), "/lights/", i);
    }
    need(&Requirements::many_lights, scene_.lights.size() > few_lights && scene_.accuracy.cutoff > 0, "/lights");
    for_each_placed(scene_, [&](const Placed& placed) {
      look_at(scene_.materials[placed.material.index]);
      look_at(placed);
    });
    return needs_;
  }

 private:
  /// Up to this many, a ray to each costs less than finding out which can be spared.
  static constexpr std::size_t few_lights = 64;

  void need(bool Requirements::*what, bool needed, std::string_view where) {
    if (!needed || needs_.*what) return;
    needs_.*what = true;
    if (reasons_ != nullptr) reasons_->push_back({what, std::string(where)});
  }
  void need(bool Requirements::*what, bool needed, std::string_view list, std::size_t index) {
    if (needed && !(needs_.*what)) need(what, true, std::string(list) + std::to_string(index));
  }

  /// A texture that `what` stands for.
  void look_at(bool Requirements::*what, TextureId texture, std::string_view where) {
    need(what, true, where);
    need(&Requirements::filtered_textures, scene_.textures[texture.index].filter == Texture::Filter::mipmap, where);
  }

  void look_at(const Background& background) {
    if (background.environment)
      look_at(&Requirements::environment, background.environment->texture, "/background/environment");
    if (!background.cube) return;
    for (const TextureId face : background.cube->faces) look_at(&Requirements::environment, face, "/background/cube");
  }

  void look_at(const Material& material) {
    const bool transmits = material.transmission > 0;
    const bool refracts = transmits && material.transparency == Material::Transparency::refract;
    const std::string_view where = material.path;
    need(&Requirements::refraction, transmits, where);
    // Without Fresnel, total internal reflection still turns transmitted weight into reflected weight.
    need(&Requirements::reflection, material.reflection > 0 || refracts, where);
    need(&Requirements::fresnel, material.fresnel && (transmits || material.reflection > 0), where);
    need(&Requirements::absorption, transmits && !(material.absorption == Color{}), where);
    need(&Requirements::overlapping_media, transmits && std::exchange(solid_seen_, true), where);
    need(&Requirements::gouraud, material.shading == Material::Shading::gouraud, where);
    if (const auto* texture = std::get_if<TextureId>(&material.color))
      look_at(&Requirements::textures, *texture, where);
    if (material.bump) look_at(&Requirements::textures, material.bump->texture, where);
    if (material.normal_map) look_at(&Requirements::textures, *material.normal_map, where);
    need(&Requirements::bump, material.bump || material.normal_map, where);
    if (caster_) need(&Requirements::shadows, material.diffuse > 0 || material.specular > 0, "/lights/", *caster_);
    transmissive_ = transmits && transmissive_.empty() ? where : transmissive_;
    need(&Requirements::transmissive_shadows, needs_.shadows && needs_.refraction, transmissive_);
  }

  void look_at(const Placed& placed) {
    const Shape& shape = placed.shape;
    const auto because = [&](bool Requirements::*what, bool needed) {
      if (needed && !(needs_.*what)) need(what, true, std::string(placed.group) + "/", placed.index);
    };
    because(&Requirements::smooth_normals, has_normals(shape));
    because(&Requirements::spheres, std::holds_alternative<Sphere>(shape));
    because(&Requirements::planes, std::holds_alternative<Plane>(shape));
    because(&Requirements::triangles, std::holds_alternative<Triangle>(shape) || std::holds_alternative<Mesh>(shape));
    because(&Requirements::quadrics, is_quadric(shape));
  }

  const Scene& scene_;
  std::vector<RequirementReason>* reasons_;
  Requirements needs_;
  std::optional<std::size_t> caster_;  ///< the first light that casts shadows
  std::string_view transmissive_;      ///< the first material that lets light through
  bool solid_seen_ = false;
};

}  // namespace

Requirements requirements(const Scene& scene, std::vector<RequirementReason>* reasons) {
  return Finder(scene, reasons).find();
}

}  // namespace tracer
