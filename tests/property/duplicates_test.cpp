// Shapes that equal an earlier one are left out, are counted, and change nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "tests/property/still_life.h"
#include "tests/support/scenes.h"

namespace {

using namespace tracer;
using still_life_tests::plenty;
using still_life_tests::still_life;

void expect_same_image(const Rendered& twice, const Rendered& once) {
  EXPECT_EQ(twice.image.rgb, once.image.rgb);
  EXPECT_EQ(twice.image.layers.object_id, once.image.layers.object_id);
  EXPECT_EQ(twice.statistics.rays, once.statistics.rays);
  EXPECT_EQ(once.statistics.duplicates, 0u);
}

Scene once() {
  Scene scene = still_life();
  scene.output.layers = {Layer::object_id};
  return scene;
}

TEST(Duplicates, OfEveryShapeAreLeftOutAndCounted) {
  Scene scene = once();
  const Rendered single = scenes::render(scene);
  const std::size_t count = scene.objects.size();
  std::uint64_t primitives = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto* mesh = std::get_if<Mesh>(&scene.objects[i].shape);
    primitives += mesh != nullptr ? mesh->triangles.size() : 1;
    scene.objects.push_back(scene.objects[i]);
  }
  const Rendered twice = scenes::render(scene);
  expect_same_image(twice, single);
  EXPECT_EQ(twice.statistics.duplicates, primitives);
}

TEST(Duplicates, OfTrianglesInAMeshAreLeftOut) {
  Scene scene = once();
  Mesh& mesh = still_life_tests::mesh_of(scene);
  mesh.smooth = false;  // means of normals over more triangles would be rounded differently
  const Rendered single = scenes::render(scene);
  const std::size_t triangles = mesh.triangles.size();
  for (int copies = 0; copies < 40; ++copies)  // so many that only a sample is searched at first
    for (std::size_t i = 0; i < triangles; ++i) mesh.triangles.push_back(mesh.triangles[i]);
  const Rendered many = scenes::render(scene);
  EXPECT_EQ(many.statistics.duplicates, 40 * triangles);
  expect_same_image(many, single);
}

TEST(Duplicates, OfInstancesAreLeftOutAndLaterObjectsKeepTheirNumbers) {
  Scene scene = scenes::empty(40, {{0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 40});
  scene.ambient = {1, 1, 1};
  scene.output.layers = {Layer::object_id};
  const MaterialId red = scenes::add(scene, scenes::matte({0.8, 0.1, 0.1}));
  scene.prototypes.push_back(
      {{{scenes::placed(scenes::icosphere(1), 0.5, {-1, 0, 0}), red, {}}, {Box{{0.2, 0, 0}, {0.6, 0.4, 0.4}}, red, {}}},
       "/prototypes/pair"});
  for (int i = 0; i < 10; ++i) scene.objects.push_back({Instance{{0}, {}}, {}, {}});
  scenes::add(scene, Sphere{{1.2, 0, 0}, 0.3}, red);
  const Rendered rendered = scenes::render(scene);
  EXPECT_EQ(rendered.statistics.duplicates, 9 * 81u);
  const auto& ids = rendered.image.layers.object_id;
  EXPECT_EQ(*std::max_element(ids.begin(), ids.end()), 21u);
  EXPECT_NE(std::find(ids.begin(), ids.end(), 2u), ids.end());
}

TEST(Duplicates, WithAnotherPlaceWindingOrTransparencyAreKept) {
  Scene scene = scenes::empty(8, {{0, 1, 5}, {0, 0, 0}, {0, 1, 0}, 40});
  const MaterialId matte = scenes::add(scene, scenes::matte({1, 1, 1}));
  const MaterialId glass = scenes::add(scene, scenes::glass());
  const Triangle triangle{{Vec3{-1, -1, 0}, Vec3{1, -1, 0}, Vec3{0, 1, 0}}, {}, {}};
  Triangle turned = triangle;
  std::swap(turned.vertices[1], turned.vertices[2]);
  for (const Shape& shape :
       {Shape{triangle}, Shape{turned}, Shape{Sphere{{0, 0, 0}, 1}}, Shape{Sphere{{0, 1e-9, 0}, 1}}, Shape{Plane{}},
        Shape{Box{}}, Shape{Box{{0, 0, 0}, {1, 1, 1.5}}}})
    for (const MaterialId material : {matte, glass}) scenes::add(scene, shape, material);
  EXPECT_EQ(scenes::render(scene).statistics.duplicates, 0u);
}

TEST(Duplicates, AreReportedForCachedGeometryToo) {
  SceneCache cache(plenty);
  Scene scene = still_life();
  const std::size_t triangles = still_life_tests::mesh_of(scene).triangles.size();
  scene.objects.push_back(scene.objects[0]);
  for (int frame = 0; frame < 2; ++frame) {
    const auto compiled = still_life_tests::compiled(scene, &cache);
    RenderControl control;
    EXPECT_EQ(cache_hits(*compiled).geometry, frame > 0);
    EXPECT_EQ(render(*compiled, {}, control)->statistics.duplicates, triangles);
  }
}

}  // namespace
