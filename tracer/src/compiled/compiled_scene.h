#pragma once
/// What `compile` makes and `render` reads: everything in the trace frame, nothing that changes.

#include <memory>
#include <optional>
#include <vector>

#include "tracer/requirements.h"
#include "tracer/src/accel/accelerator.h"
#include "tracer/src/cameras/compiled_camera.h"
#include "tracer/src/lights/compiled_light.h"
#include "tracer/src/lights/shadow_map.h"
#include "tracer/src/materials/compiled_material.h"
#include "tracer/src/scene/render_space.h"
#include "tracer/src/textures/background.h"
#include "tracer/src/textures/image_map.h"

namespace tracer {

class CompiledScene {
 public:
  CompiledScene(const Scene& scene, const RenderSpace& render_space)
      : frame(render_space),
        needs(requirements(scene)),
        exact_needs(scene.accuracy.approximate.any() ? exact_requirements(scene) : needs),
        camera(scene.camera, scene.image, render_space),
        image(scene.image),
        accuracy(scene.accuracy),
        depth_cue(scene.depth_cue),
        output(scene.output),
        ambient(scene.ambient),
        materials(scene.materials),
        terms(compiled_materials(scene.materials, scene.ambient)),
        textures(scene.textures) {}

  RenderSpace frame;
  Requirements needs;
  Requirements exact_needs;  ///< of samples without approximations, which tell what these cost
  CompiledCamera camera;
  ImageSize image;
  Accuracy accuracy;
  std::optional<CompiledBackground> background;  ///< set once its textures are there
  std::optional<DepthCue> depth_cue;
  Output output;
  Color ambient;
  std::vector<Material> materials;
  std::vector<CompiledMaterial> terms;  ///< beside them
  std::vector<Texture> textures;
  std::vector<std::shared_ptr<const ImageMap>> images;  ///< beside textures; null where the texture is no image
  std::vector<CompiledLight> lights;
  std::vector<ShadowMap> shadow_maps;  ///< beside lights; empty unless shadows are approximated by them
  std::vector<std::uint32_t> material_of_object;
  std::vector<std::uint32_t> media_enclosing_camera;  ///< transmissive solids it is inside of, outermost first
  std::vector<Axes> axes_of_object;  ///< texture coordinates: a sphere's axes; a plane's e0 and e1 are the world
                                     ///< gradients of u and v. Empty without textures
  std::shared_ptr<const Accelerator> accelerator;  ///< set once it is built
  std::uint64_t max_transmissive_hits = 0;         ///< of its geometry
  CacheHits cache_hits;

  [[nodiscard]] const GeometrySet& geometry() const { return accelerator->geometry(); }
  [[nodiscard]] const Material& material_of(std::uint32_t object) const {
    return materials[material_of_object[object]];
  }
};

}  // namespace tracer
