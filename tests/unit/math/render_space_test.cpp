// Render space: its extent, and small parts of it without rounding.
#include "tracer/src/scene/render_space.h"

#include <gtest/gtest.h>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/support/scenes.h"

namespace tracer {
namespace {

using oracle::Random;

FiniteBounds bounds_of(const std::vector<Vec3>& points) {
  FiniteBounds bounds;
  for (const Vec3& p : points) bounds.include(p);
  return bounds;
}

TEST(RenderSpace, ReachesHalfAUnitFromTheOriginAndTheSceneSpansAtLeastThat) {
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const double scale = random.spread(1e-60, 1e60);
    const std::vector<Vec3> points{random.vector(scale), random.vector(scale), random.vector(scale)};
    const RenderSpace frame(bounds_of(points));
    double largest = 0;
    for (const Vec3& p : points) {
      const Vec3 q = frame.render_from_world(p);
      ASSERT_LE(max_component(abs(q)), 0.5 + 1e-15);
      for (const Vec3& other : points)
        largest = std::max(largest, max_component(abs(q - frame.render_from_world(other))));
    }
    ASSERT_GT(largest, 0.5 - 1e-12);
  }
}

TEST(RenderSpace, RoundsNothingOfSmallPartsInALargeScene) {
  Random random(5);
  for (std::uint64_t i = 0; i < effort::cases(10'000); ++i) {
    const Vec3 small = rounded(random.direction()) * std::exp(random.in(-60, 0));
    const Vec3 large = rounded(random.direction()) * std::exp(random.in(20, 60));
    FiniteBounds extent = bounds_of({small, large, {0, 0, 0}});
    extent.smallest = 1;
    const RenderSpace frame(extent);
    const double scale = frame.render_from_world(1.0);
    ASSERT_EQ(frame.render_from_world(small), small * scale);
    ASSERT_LE(largest_component(frame.render_from_world(large)), 0.5);
  }
}

TEST(RenderSpace, NotesTheSmallestObjectOrTriangle) {
  Scene scene = scenes::empty(1);
  scenes::add(scene, Sphere{{0, 0, 0}, 8}, scenes::matte({1, 1, 1}));
  EXPECT_EQ(finite_bounds(scene).smallest, 16);
  scenes::add(
      scene,
      Mesh{{{0, 0, 0}, {9, 0, 0}, {0, 9, 0}, {0, 2, 0}, {1, 0, 0}}, {{0, 1, 2}, {0, 3, 4}, {1, 1, 1}}, {}, {}, false},
      MaterialId{0});
  EXPECT_EQ(finite_bounds(scene).smallest, 2) << "without triangles that are points";
  EXPECT_FALSE(finite_bounds(scene).is_mixed());
  scenes::add(scene, Sphere{{0, 0, 1e9}, 1}, MaterialId{0});
  EXPECT_TRUE(finite_bounds(scene).is_mixed());
}

TEST(RenderSpace, IsCenteredAtTheCameraWithoutFiniteShapes) {
  Scene scene;
  scene.camera.position = {1e9, 2, 3};
  EXPECT_EQ(RenderSpace(finite_bounds(scene)).render_from_world(scene.camera.position), (Vec3{0, 0, 0}));
}

TEST(RenderSpace, ContainsTheBoundsOfEveryShape) {
  Scene scene;
  scene.objects.push_back({Sphere{{1, 2, 3}, 0.5}, {}, {}});
  scene.objects.push_back({Plane{{100, 100, 100}, {0, 1, 0}, {}}, {}, {}});  // infinite: not counted
  scene.objects.push_back({Triangle{{{{-4, 0, 0}, {0, 5, 0}, {0, 0, 1}}}, {}, {}}, {}, {}});
  Mesh mesh;
  mesh.positions = {{0, -6, 0}, {7, 0, 0}};
  scene.objects.push_back({mesh, {}, {}});
  const Bounds bounds = finite_bounds(scene);
  EXPECT_EQ(bounds.low, (Vec3{-4, -6, 0}));
  EXPECT_EQ(bounds.high, (Vec3{7, 5, 3.5}));
}

}  // namespace
}  // namespace tracer
