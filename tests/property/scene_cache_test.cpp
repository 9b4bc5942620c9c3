// Scene cache: sharing of geometry between scenes, threads, cancellation and budget.
#include "tracer/scene_cache.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <functional>
#include <thread>

#include "tests/property/still_life.h"

namespace {

using namespace still_life_tests;

struct Change {
  const char* name;
  std::function<void(Scene&)> make;
};

TEST(SceneCache, GivesTheSameImagesToScenesThatShareShapes) {
  const std::vector<Change> changes = {
      {"nothing", [](Scene&) {}},
      {"camera",
       [](Scene& s) {
         s.camera.position = {2, 2, 4};
       }},
      {"image",
       [](Scene& s) {
         s.image = {31, 17, {}};
       }},
      {"light",
       [](Scene& s) {
         s.lights.push_back(scenes::directional_light({0, -1, -1}));
       }},
      {"background",
       [](Scene& s) {
         s.background.color = {0.1, 0.2, 0.7};
       }},
      {"accuracy", [](Scene& s) { s.accuracy.samples = 3; }},
      {"color",
       [](Scene& s) {
         s.materials[0].color = Color{0, 1, 0};
       }},
      {"texture",
       [](Scene& s) {
         s.textures.push_back({CheckerTexture{{Color{1, 0, 0}, Color{0, 0, 1}}}, {9, 9}, {}, {}, {}, {}});
         s.materials[0].color = TextureId{0};
       }},
      {"flat shading", [](Scene& s) { s.materials[0].shading = Material::Shading::flat; }},
  };
  SceneCache cache(plenty);
  EXPECT_FALSE(reuses(still_life(), cache)) << "the first must build";
  for (const Change& change : changes) {
    Scene scene = still_life();
    change.make(scene);
    const Compiled shared = compiled(scene, &cache);
    EXPECT_TRUE(cache_hits(*shared).geometry) << change.name;
    RenderControl control;
    const Rendered with = *render(*shared, {.threads = 1}, control);
    const Rendered without = scenes::render(scene);
    EXPECT_EQ(with.image.rgb, without.image.rgb) << change.name;
    EXPECT_EQ(with.statistics, without.statistics) << change.name;
    EXPECT_EQ(memory_bytes(*shared), memory_bytes(*compiled(scene, nullptr))) << change.name;
  }
}

TEST(SceneCache, RebuildsGeometryIfTheImageCouldDiffer) {
  const std::vector<Change> changes = {
      {"a vertex, by its last bit",
       [](Scene& s) {
         double& x = mesh_of(s).positions[77].x;
         x = std::bit_cast<double>(std::bit_cast<std::uint64_t>(x) ^ 1u);
       }},
      {"a triangle's corners", [](Scene& s) { std::swap(mesh_of(s).triangles[5][0], mesh_of(s).triangles[5][1]); }},
      {"normals", [](Scene& s) { mesh_of(s).smooth = false; }},
      {"texture coordinates", [](Scene& s) { mesh_of(s).uvs.resize(mesh_of(s).positions.size()); }},
      {"a sphere", [](Scene& s) { std::get<Sphere>(s.objects[1].shape).radius = 0.625; }},
      {"a cylinder's caps", [](Scene& s) { std::get<Cylinder>(s.objects[2].shape).caps = false; }},
      {"a cone", [](Scene& s) { std::get<Cone>(s.objects[3].shape).apex_radius = 0.125; }},
      {"a loose triangle", [](Scene& s) { std::get<Triangle>(s.objects[4].shape).vertices[0].z = 0.125; }},
      {"a plane", [](Scene& s) { std::get<Plane>(s.objects[5].shape).point.y = -1.5; }},
      {"what is transmissive", [](Scene& s) { s.materials[0].transmission = 0.5; }},
      {"an instance more",
       [](Scene& s) {
         s.prototypes.push_back({{{Sphere{}, {0}, {}}}, "/prototypes/ball"});
         s.objects.push_back({Instance{{0}, {}}, {}, {}});
       }},
      {"one object less", [](Scene& s) { s.objects.erase(s.objects.begin() + 4); }},
      {"the frame",
       [](Scene& s) {
         scenes::add(s, Sphere{{40, 0, 0}, 1}, scenes::mirror());
       }},
      {"a transform",
       [](Scene& s) {
         s.objects[0].transform = Transform{{{{1, 0, 0, 0.5}, {0, 1, 0, 0}, {0, 0, 1, 0}}}};
       }},
  };
  SceneCache cache(plenty);
  EXPECT_FALSE(reuses(still_life(), cache));
  for (const Change& change : changes) {
    Scene scene = still_life();
    change.make(scene);
    EXPECT_FALSE(reuses(scene, cache)) << change.name;
    EXPECT_TRUE(reuses(scene, cache)) << change.name << ", once more";
  }
}

TEST(SceneCache, EvictsTheLeastRecentlyUsed) {
  SceneCache big(plenty);
  reuses(still_life(), big);
  const std::uint64_t each = big.memory_bytes().all();
  ASSERT_GT(each, SceneCache::worthwhile_bytes);

  SceneCache cache(2 * each + each / 2);
  const Scene a = still_life(1), b = still_life(0.5), c = still_life(0.25);
  EXPECT_FALSE(reuses(a, cache));
  EXPECT_FALSE(reuses(b, cache));
  EXPECT_TRUE(reuses(a, cache));
  EXPECT_FALSE(reuses(c, cache)) << "and b, used least lately, goes";
  EXPECT_LE(cache.memory_bytes().all(), 2 * each + each / 2);
  EXPECT_TRUE(reuses(a, cache));
  EXPECT_TRUE(reuses(c, cache));
  EXPECT_FALSE(reuses(b, cache));
}

TEST(SceneCache, StoresNeitherTooLargeNorTrivialParts) {
  SceneCache none(0);
  EXPECT_FALSE(reuses(still_life(), none));
  EXPECT_FALSE(reuses(still_life(), none));
  EXPECT_EQ(none.memory_bytes().all(), 0u);

  Scene small = scenes::empty(8);
  scenes::add(small, Sphere{}, scenes::mirror());
  SceneCache cache(plenty);
  EXPECT_FALSE(reuses(small, cache));
  EXPECT_FALSE(reuses(small, cache));
  EXPECT_EQ(cache.memory_bytes().all(), 0u);
}

TEST(SceneCache, KeepsCompiledScenesValidWhenCleared) {
  auto cache = std::make_unique<SceneCache>(plenty);
  const Compiled scene = compiled(still_life(), cache.get());
  cache->clear();
  EXPECT_EQ(cache->memory_bytes().all(), 0u);
  EXPECT_FALSE(reuses(still_life(), *cache));
  cache.reset();
  RenderControl control;
  EXPECT_EQ(render(*scene, {.threads = 1}, control)->image.rgb, scenes::render(still_life()).image.rgb);
}

TEST(SceneCache, BuildsOnceForConcurrentScenes) {
  SceneCache cache(plenty);
  const Scene scene = still_life();
  std::vector<Compiled> results(8);
  std::vector<std::thread> threads;
  for (Compiled& result : results) threads.emplace_back([&] { result = compiled(scene, &cache); });
  for (std::thread& thread : threads) thread.join();
  const auto built = [](const Compiled& result) { return !cache_hits(*result).geometry; };
  EXPECT_EQ(std::count_if(results.begin(), results.end(), built), 1);
}

/// The thread that builds may be one of those that are cancelled.
TEST(SceneCache, LetsOthersBuildIfTheBuilderIsCancelled) {
  const Scene scene = still_life();
  int cancelled = 0;
  for (int round = 0; round < 40; ++round) {
    SceneCache cache(plenty);
    RenderControl given_up;
    Compiled wanted;
    std::thread first([&] { cancelled += compiled(scene, &cache, given_up) ? 0 : 1; });
    std::thread second([&] { wanted = compiled(scene, &cache); });
    std::thread someone([&] {
      std::this_thread::sleep_for(std::chrono::microseconds(100 * round));
      given_up.cancel();
    });
    for (std::thread* thread : {&first, &second, &someone}) thread->join();
    ASSERT_NE(wanted, nullptr);
    EXPECT_TRUE(reuses(scene, cache)) << "what it built is kept";
  }
  EXPECT_GT(cancelled, 0) << "the first round cancels at once";
}

}  // namespace
