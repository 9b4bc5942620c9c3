// Scene cache: sharing of geometry between scenes, threads, cancellation and budget.
#include "tracer/scene_cache.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <thread>
#include <utility>
#include <vector>

#include "tests/property/still_life.h"

namespace {

using namespace still_life_tests;

/// Still lifes, and what is changed in each of them.
class ChangedScenes {
 public:
  Scene& operator()(const char* change) { return scenes_.emplace_back(change, still_life()).second; }
  [[nodiscard]] auto begin() const { return scenes_.begin(); }
  [[nodiscard]] auto end() const { return scenes_.end(); }

 private:
  std::vector<std::pair<const char*, Scene>> scenes_;
};

TEST(SceneCache, GivesTheSameImagesToScenesThatShareShapes) {
  ChangedScenes with;
  with("nothing");
  with("camera").camera.position = {2, 2, 4};
  with("image").image = {31, 17, {}};
  with("light").lights.push_back(scenes::directional_light({0, -1, -1}));
  with("background").background.color = {0.1, 0.2, 0.7};
  with("accuracy").accuracy.samples = 3;
  with("color").materials[0].color = Color{0, 1, 0};
  Scene& textured = with("texture");
  textured.textures.push_back({CheckerTexture{{Color{1, 0, 0}, Color{0, 0, 1}}}, {9, 9}, {}, {}, {}, {}});
  textured.materials[0].color = TextureId{0};
  with("flat shading").materials[0].shading = Material::Shading::flat;
  SceneCache cache(plenty);
  EXPECT_FALSE(reuses(still_life(), cache)) << "the first must build";
  for (const auto& [change, scene] : with) {
    const Compiled shared = compiled(scene, &cache);
    EXPECT_TRUE(cache_hits(*shared).geometry) << change;
    RenderControl control;
    const Rendered rendered = *render(*shared, {.threads = 1}, control), without = scenes::render(scene);
    EXPECT_EQ(rendered.image.rgb, without.image.rgb) << change;
    EXPECT_EQ(rendered.statistics, without.statistics) << change;
    EXPECT_EQ(memory_bytes(*shared), memory_bytes(*compiled(scene, nullptr))) << change;
  }
}

TEST(SceneCache, RebuildsGeometryIfTheImageCouldDiffer) {
  ChangedScenes with;
  double& x = mesh_of(with("a vertex, by its last bit")).positions[77].x;
  x = std::bit_cast<double>(std::bit_cast<std::uint64_t>(x) ^ 1u);
  auto& triangle = mesh_of(with("a triangle's corners")).triangles[5];
  std::swap(triangle[0], triangle[1]);
  mesh_of(with("normals")).smooth = false;
  Mesh& mesh = mesh_of(with("texture coordinates"));
  mesh.uvs.resize(mesh.positions.size());
  std::get<Sphere>(with("a sphere").objects[1].shape).radius = 0.625;
  std::get<Cylinder>(with("a cylinder's caps").objects[2].shape).caps = false;
  std::get<Cone>(with("a cone").objects[3].shape).apex_radius = 0.125;
  std::get<Triangle>(with("a loose triangle").objects[4].shape).vertices[0].z = 0.125;
  std::get<Plane>(with("a plane").objects[5].shape).point.y = -1.5;
  with("what is transmissive").materials[0].transmission = 0.5;
  Scene& instanced = with("an instance more");
  instanced.prototypes.push_back({{{Sphere{}, {0}, {}}}, "/prototypes/ball"});
  instanced.objects.push_back({Instance{{0}, {}}, {}, {}});
  std::vector<Object>& fewer = with("one object less").objects;
  fewer.erase(fewer.begin() + 4);
  scenes::add(with("the frame"), Sphere{{40, 0, 0}, 1}, scenes::mirror());
  with("a transform").objects[0].transform = Transform{{{{1, 0, 0, 0.5}, {0, 1, 0, 0}, {0, 0, 1, 0}}}};
  SceneCache cache(plenty);
  EXPECT_FALSE(reuses(still_life(), cache));
  for (const auto& [change, scene] : with) {
    EXPECT_FALSE(reuses(scene, cache)) << change;
    EXPECT_TRUE(reuses(scene, cache)) << change << ", once more";
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
