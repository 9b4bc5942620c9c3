#pragma once
/// A scene with something of everything, compiled with a cache of scenes.

#include <gtest/gtest.h>

#include <memory>
#include <utility>

#include "tests/support/scenes.h"
#include "tracer/scene_cache.h"

namespace still_life_tests {

using namespace tracer;

inline constexpr std::uint64_t plenty = 1u << 30;

using Compiled = std::shared_ptr<const CompiledScene>;

/// Compiles a scene without files; null after cancellation.
inline Compiled compiled(Scene scene, SceneCache* cache, RenderControl& control) {
  std::shared_ptr<SceneCacheEntry> entry;
  if (cache != nullptr) {
    auto acquired = cache->acquire(scene, {}, control);
    if (!acquired) return nullptr;
    entry = *std::move(acquired);
  }
  auto result = compile(scene, control, {}, entry.get());
  return result ? *result : nullptr;
}

inline Compiled compiled(const Scene& scene, SceneCache* cache) {
  RenderControl control;
  Compiled result = compiled(scene, cache, control);
  EXPECT_NE(result, nullptr);
  return result;
}

inline bool reuses(const Scene& scene, SceneCache& cache) { return cache_hits(*compiled(scene, &cache)).geometry; }

/// A mesh, glass, quadrics, loose triangles and a plane: one of each kind of geometry.
inline Scene still_life(double size = 1) {
  Scene scene = scenes::empty(40, {{0, 1, 5}, {0, 0, 0}, {0, 1, 0}, 40});
  scene.lights = {scenes::point_light({3, 5, 4})};
  scenes::add(scene, scenes::placed(scenes::icosphere(4, true), size, {-0.5, 0, 0}), scenes::matte({0.8, 0.5, 0.2}));
  scenes::add(scene, Sphere{{0.9, 0, 0.5}, 0.5}, scenes::glass());
  scenes::add(scene, Cylinder{{1, -1, -1}, {1, 1, -1}, 0.3, true, {}}, scenes::mirror());
  scenes::add(scene, Cone{}, scenes::matte({0.1, 0.4, 0.9}));
  scenes::add(scene, Triangle{{Vec3{-2, -1, 0}, Vec3{-1, -1, 1}, Vec3{-2, 1, 0}}, {}, {}}, scenes::mirror(0.5));
  scenes::add(scene, Plane{{0, -1, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
  scene.accuracy.max_depth = 4;
  return scene;
}

/// The mesh of a still life, or of a scene derived from one.
inline Mesh& mesh_of(Scene& scene) { return std::get<Mesh>(scene.objects[0].shape); }

}  // namespace still_life_tests
