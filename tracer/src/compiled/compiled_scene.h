#pragma once
/// The immutable scene in render space: result of compile(), input of render().

#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "tracer/requirements.h"
#include "tracer/src/accel/accelerator.h"
#include "tracer/src/cameras/compiled_camera.h"
#include "tracer/src/lights/emitters.h"
#include "tracer/src/lights/light_registry.h"
#include "tracer/src/lights/shadow_map.h"
#include "tracer/src/materials/compiled_material.h"
#include "tracer/src/radiosity/patches.h"
#include "tracer/src/scene/medium_boundary.h"
#include "tracer/src/scene/render_space.h"
#include "tracer/src/textures/background.h"
#include "tracer/src/textures/image_map.h"

namespace tracer {

/// Properties of objects, which are numbered after instancing, in document order.
struct ObjectTable {
  std::vector<std::uint32_t> material;
  std::vector<std::uint8_t> shadowless;  ///< 1: shadow rays pass unchanged
  std::vector<Axes> uv_axes;  ///< axes of a sphere; a plane's e0 and e1 are the world gradients of u and v. Empty
                              ///< without textures
  Emitters emitters;          ///< those that glow; empty unless the scene needs them
  std::shared_ptr<const Radiosity> radiosity;  ///< null unless patches approximate diffuse light
  std::vector<MediumBoundary> boundary;        ///< up to the last object that lets light or shadow rays pass
  std::vector<float> diagonal;                 ///< diagonals of bounding boxes, world
};

class CompiledScene {
 public:
  CompiledScene(const Scene& scene, const RenderSpace& render_space)
      : frame(render_space),
        needs(requirements(scene)),
        camera(scene.camera, scene.image, render_space),
        image(scene.image),
        accuracy(scene.accuracy),
        depth_cue(scene.depth_cue),
        output(scene.output),
        ambient(scene.accuracy.has_ambient_term(scene.accuracy.approximate) ? scene.ambient : Color{}),
        materials(scene.materials),
        terms(compiled_materials(scene.materials, ambient)),
        textures(scene.textures) {
    media.outside = scene.medium;
    exact.needs = scene.accuracy.approximate.any() ? exact_requirements(scene) : needs;
    if (accuracy.has_ambient_term({}) != accuracy.has_ambient_term(accuracy.approximate))
      exact.terms = compiled_materials(scene.materials, {});
  }

  RenderSpace frame;
  Requirements needs;
  struct Exact {  ///< for the exact samples that measure the error of approximations
    Requirements needs;
    std::vector<CompiledMaterial> terms;  ///< empty if they are those of the image
  } exact;
  CompiledCamera camera;
  ImageSize image;
  Accuracy accuracy;
  std::optional<CompiledBackground> background;  ///< set after its textures
  std::optional<DepthCue> depth_cue;
  Output output;
  Color ambient;  ///< black where surfaces light each other instead
  std::vector<Material> materials;
  std::vector<CompiledMaterial> terms;  ///< parallel to materials
  std::vector<Texture> textures;
  std::vector<std::shared_ptr<const ImageMap>> images;  ///< parallel to textures; null unless the texture is an image
  std::vector<CompiledLight> lights;
  std::vector<ShadowMap> shadow_maps;  ///< parallel to lights; empty unless they approximate shadows
  ObjectTable objects;
  struct Media {
    Medium outside;
    std::vector<std::uint32_t> enclosing_camera;  ///< transmissive solids, outermost first
  } media;
  std::shared_ptr<const Accelerator> accelerator;  ///< set after it is built
  CacheHits cache_hits;

  /// Requirements of samples with the given approximations, which are those of the image or none.
  [[nodiscard]] const Requirements& needs_of(const Approximations& approximate) const {
    return approximate == accuracy.approximate ? needs : exact.needs;
  }
  [[nodiscard]] const std::vector<CompiledMaterial>& terms_of(const Approximations& approximate) const {
    return approximate == accuracy.approximate || exact.terms.empty() ? terms : exact.terms;
  }
  [[nodiscard]] Color ambient_of(const Approximations& approximate) const {
    return accuracy.has_ambient_term(approximate) ? ambient : Color{};
  }

  /// True unless patches hold diffuse light whose error has no bound.
  [[nodiscard]] bool has_bounded_patches() const {
    return objects.radiosity == nullptr || std::isfinite(objects.radiosity->figures.bound);
  }
  [[nodiscard]] const GeometrySet& geometry() const { return accelerator->geometry(); }
  [[nodiscard]] const Material& material_of(std::uint32_t object) const { return materials[objects.material[object]]; }
};

/// Factor of the radiance at depth z.
inline double depth_cue_scale(const DepthCue& cue, double z) {
  if (z <= cue.front) return cue.front_scale;
  if (!(z < cue.back)) return cue.back_scale;
  const double towards_back = (z - cue.front) / (cue.back - cue.front);
  return cue.front_scale + (cue.back_scale - cue.front_scale) * towards_back;
}

}  // namespace tracer
