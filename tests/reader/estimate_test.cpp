// What a scene will take, told before it is begun.
#include "api/estimate.h"

#include <gtest/gtest.h>

namespace {

tracer::Scene scene_of(std::uint32_t width, std::uint32_t height, std::uint32_t samples) {
  tracer::Scene scene;
  scene.image = {width, height, {}};
  scene.accuracy.samples = samples;
  return scene;
}

TEST(IsLarge, ByTheSamplesOfWhatIsRendered) {
  EXPECT_FALSE(api::is_large({})) << "what a document without sizes asks for";
  EXPECT_FALSE(api::is_large(scene_of(2048, 1024, 1)));
  EXPECT_TRUE(api::is_large(scene_of(2048, 1025, 1)));
  EXPECT_TRUE(api::is_large(scene_of(512, 512, 9)));
  tracer::Scene cropped = scene_of(2048, 1024, 4);
  cropped.image.crop = tracer::PixelWindow{0, 0, 512, 1024};
  EXPECT_FALSE(api::is_large(cropped));
}

TEST(IsLarge, ByTheMostSamplesThereMayBeWhereTheyAdaptUnlessTimeEndsThemSoon) {
  tracer::Scene scene = scene_of(64, 64, 1'000'000);
  scene.accuracy.adaptive = tracer::Adaptive{};
  scene.accuracy.adaptive->samples_max = 512;
  EXPECT_FALSE(api::is_large(scene));
  scene.accuracy.adaptive->samples_max = 513;
  EXPECT_TRUE(api::is_large(scene));
  scene.accuracy.adaptive->time_budget_ms = 2001;
  EXPECT_TRUE(api::is_large(scene));
  scene.accuracy.adaptive->time_budget_ms = 2000;
  EXPECT_FALSE(api::is_large(scene));
}

TEST(IsLarge, ByItsMemory) {
  tracer::Scene scene = scene_of(16, 16, 1);
  tracer::Mesh mesh;
  mesh.triangles.resize(1'000'000);
  scene.objects.push_back({mesh, {}, {}});
  EXPECT_FALSE(api::is_large(scene));
  mesh.triangles.resize(2'000'000);
  scene.objects.push_back({mesh, {}, {}});
  EXPECT_TRUE(api::is_large(scene));
}

TEST(IsLarge, ByMeshesWhoseSizeNobodyKnowsWhereverTheyAre) {
  tracer::Scene scene = scene_of(16, 16, 1);
  tracer::Mesh of_file;
  of_file.file = tracer::AssetId{0};
  scene.objects.push_back({of_file, {}, {}});
  EXPECT_TRUE(api::is_large(scene));
  scene.objects.clear();
  scene.prototypes.push_back({{{of_file, {}, {}}}, "/prototypes/tree"});
  EXPECT_TRUE(api::is_large(scene));
}

}  // namespace
