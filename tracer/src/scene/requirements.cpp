#include "tracer/requirements.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "tracer/src/materials/compiled_material.h"
#include "tracer/src/scene/instancing.h"
#include "tracer/src/shapes/shape_registry.h"

namespace tracer {
namespace {

bool has_normals(const Shape& shape) {
  if (const auto* mesh = std::get_if<Mesh>(&shape)) return mesh->smooth || !mesh->normals.empty();
  if (const auto* triangle = std::get_if<Triangle>(&shape)) return triangle->normals.has_value();
  return false;
}

/// Collects needs and the first reason for each.
class Finder {
 public:
  Finder(const Scene& scene, const Approximations& approximate, std::vector<RequirementReason>* reasons)
      : scene_(scene), approximate_(approximate), reasons_(reasons) {}

  Requirements find() {
    need(&Requirements::approximations, approximate_.any(), "/accuracy/approximate");
    need(&Requirements::interreflection, approximate_.interreflection != Approximations::Interreflection::exact,
         "/accuracy/approximate/interreflection");
    const bool several_samples = scene_.accuracy.samples > 1 || scene_.accuracy.adaptive;
    need(&Requirements::lens, scene_.camera.aperture > 0 && several_samples, "/camera/aperture");
    need(&Requirements::depth_cue, scene_.depth_cue.has_value(), "/depth_cue");
    need(&Requirements::layers, !scene_.output.layers.empty(), "/output/layers");
    need(&Requirements::layers, scene_.output.alpha, "/output/alpha");
    need(&Requirements::absorption, absorbs_, "/medium/absorption");
    add(scene_.background);
    for (std::size_t i = 0; i < scene_.lights.size(); ++i) {
      if (exact_shadows() && scene_.lights[i].shadows && !caster_) caster_ = i;
      need(&Requirements::soft_lights, is_area_light(scene_.lights[i].source), "/lights/", i);
    }
    const std::size_t nearest = approximate_.nearest_lights;
    const std::size_t evaluated = nearest == 0 ? scene_.lights.size() : std::min(nearest, scene_.lights.size());
    need(&Requirements::many_lights, exact_shadows() && evaluated > few_lights && scene_.accuracy.cutoff != 0.0,
         "/lights");
    for_each_placed(scene_, [&](const Placed& placed) {
      add(scene_.materials[placed.material.index]);
      add(placed);
    });
    if (emitter_) need(&Requirements::emitters, needs_.global_light, *emitter_);
    const Background& sky = scene_.background;
    need(&Requirements::emitters, needs_.global_light && sky.environment, "/background/environment");
    need(&Requirements::emitters, needs_.global_light && sky.cube, "/background/cube");
    return needs_;
  }

 private:
  /// Up to this number, tracing a shadow ray to each light costs less than culling.
  static constexpr std::size_t few_lights = 64;

  [[nodiscard]] bool exact_shadows() const { return approximate_.shadows == Approximations::Shadows::exact; }

  void need(bool Requirements::*what, bool needed, std::string_view where) {
    if (!needed || needs_.*what) return;
    needs_.*what = true;
    if (reasons_ != nullptr) reasons_->push_back({what, std::string(where)});
  }
  void need(bool Requirements::*what, bool needed, std::string_view list, std::size_t index) {
    if (needed && !(needs_.*what)) need(what, true, std::string(list) + std::to_string(index));
  }

  /// Reports the requirements of the texture of `what`.
  void add(bool Requirements::*what, TextureId texture, std::string_view where) {
    need(what, true, where);
    need(&Requirements::filtered_textures, scene_.textures[texture.index].filter == Texture::Filter::mipmap, where);
  }

  void add(const Background& background) {
    if (background.environment)
      add(&Requirements::environment, background.environment->texture, "/background/environment");
    if (!background.cube) return;
    for (const TextureId face : background.cube->faces) add(&Requirements::environment, face, "/background/cube");
  }

  void add(const Material& material) {
    using Reflections = Approximations::Reflections;
    const bool branches = approximate_.reflections == Reflections::exact;
    const bool transmits = material.transmission > 0, passes = lets_light_pass(material);
    const bool refracts = transmits && material.transparency == Material::Transparency::refract;
    const std::string_view where = material.path;
    need(&Requirements::refraction, branches && passes, where);
    // Without Fresnel, total internal reflection still converts transmitted to reflected throughput.
    const bool principled = material.model == Material::Model::principled;
    need(&Requirements::principled, principled, where);
    need(&Requirements::reflection, branches && (material.reflection > 0 || refracts || principled), where);
    const bool goes_on = approximate_.reflections != Reflections::none && (transmits || material.reflection > 0);
    need(&Requirements::fresnel, material.fresnel && goes_on, where);
    need(&Requirements::absorption, transmits && !(material.absorption == Color{}), where);
    need(&Requirements::overlapping_media,
         (branches || exact_shadows()) && transmits && std::exchange(solid_seen_, true), where);
    need(&Requirements::gouraud, is_lit_by_triangle(shading_of(material.shading, approximate_.shading)),
         approximate_.shading == Approximations::Shading::exact ? where : "/accuracy/approximate/shading");
    for_each_color_texture(material, [&](TextureId texture) { add(&Requirements::textures, texture, where); });
    if (material.bump) add(&Requirements::textures, material.bump->texture, where);
    if (material.normal_map) add(&Requirements::textures, *material.normal_map, where);
    need(&Requirements::bump, material.bump || material.normal_map, where);
    const bool global = scene_.accuracy.has_interreflection(approximate_) && scatters_light(material);
    need(&Requirements::global_light, global, "/accuracy/model");
    const bool from_behind = transmits_light(material) && (global || !scene_.lights.empty());
    need(&Requirements::transmitted_light, from_behind, where);
    const bool is_lit = material.diffuse > 0 || material.specular > 0 || from_behind;
    if (caster_) need(&Requirements::shadows, is_lit, "/lights/", *caster_);
    if (passes && !transmissive_) transmissive_ = where;
    need(&Requirements::transmissive_shadows, needs_.shadows && transmissive_, transmissive_.value_or(where));
    need(&Requirements::transmissive_shadows, needs_.shadows && absorbs_, "/medium/absorption");
  }

  void add(const Placed& placed) {
    const Shape& shape = placed.shape;
    const auto because = [&](bool Requirements::*what, bool needed) {
      if (needed && !(needs_.*what)) need(what, true, pointer(placed));
    };
    const Material& material = scene_.materials[placed.material.index];
    if (may_be_bright(material.emission) && !emitter_ && !std::holds_alternative<Plane>(shape))
      emitter_ = material.path;
    because(&Requirements::transmissive_shadows, needs_.shadows && !placed.shadow);
    because(&Requirements::smooth_normals, approximate_.shading != Approximations::Shading::flat && has_normals(shape));
    because(&Requirements::spheres, std::holds_alternative<Sphere>(shape));
    because(&Requirements::planes, std::holds_alternative<Plane>(shape));
    because(&Requirements::triangles, std::holds_alternative<Triangle>(shape) || std::holds_alternative<Mesh>(shape));
    const bool is_analytic = std::visit([](const auto& any) { return Analytic<std::decay_t<decltype(any)>>; }, shape);
    because(&Requirements::quadrics, is_analytic && !std::holds_alternative<Sphere>(shape));
  }

  const Scene& scene_;
  const Approximations approximate_;
  const bool absorbs_ = !(scene_.medium.absorption == Color{});
  std::vector<RequirementReason>* reasons_;
  Requirements needs_;
  std::optional<std::size_t> caster_;             ///< the first light that casts shadows
  std::optional<std::string_view> transmissive_;  ///< the first transmissive material
  std::optional<std::string_view> emitter_;       ///< the first material that glows on a finite surface
  bool solid_seen_ = false;
};

}  // namespace

Requirements requirements(const Scene& scene, std::vector<RequirementReason>* reasons) {
  return Finder(scene, scene.accuracy.approximate, reasons).find();
}

Requirements exact_requirements(const Scene& scene) { return Finder(scene, {}, nullptr).find(); }

}  // namespace tracer
