// Points at which light arrives on surfaces.
#include "tracer/src/compile/patch_points.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/scenes.h"
#include "tracer/compile.h"

namespace tracer {
namespace {

void add_rectangle(Scene& scene, const Vec3& corner, const Vec3& u, const Vec3& v) {
  Mesh mesh;
  mesh.positions = {corner, corner + u, corner + u + v, corner + v};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  scenes::add(scene, mesh, scenes::matte({1, 1, 1}));
}

/// A floor of 2 x 2 in the plane z = 0, and over its middle the top and the walls of a block of 1 x 1 x 1, whose open
/// bottom is at the height `bottom`; with a light at the height `light`.
Scene block_over_floor(double bottom, double light) {
  Scene scene = scenes::empty(8);
  scene.lights.push_back(scenes::point_light({0, 0, light}));
  add_rectangle(scene, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0});
  add_rectangle(scene, {-0.5, -0.5, bottom + 1}, {1, 0, 0}, {0, 1, 0});
  for (const double side : {-0.5, 0.5}) {
    add_rectangle(scene, {side, -0.5, bottom}, {0, 1, 0}, {0, 0, 1});
    add_rectangle(scene, {-0.5, side, bottom}, {1, 0, 0}, {0, 0, 1});
  }
  return scene;
}

struct FloorPoints {
  int below_block = 0, beside_block = 0;
};

/// Points on the upper side of the floor.
FloorPoints points_on_floor(const Scene& scene, double gap = 0) {
  constexpr std::uint32_t lines = 20'000;
  RenderControl control;
  const auto compiled = *compile(scene, control);
  FloorPoints count;
  const RenderSpace& space = compiled->frame;
  const Vec3 center = space.render_from_world(Vec3{0, 0, 0});
  const double half = space.render_from_world(0.5);
  const PatchPoints surfaces(*compiled, {center, 8 * half}, control);
  for (const PatchPoint& at : surfaces.on_lines(lines, space.render_from_world(gap))) {
    if (at.object != 0 || at.outward.z < 0) continue;
    const Vec3 from_center = at.point.position - center;
    const bool below = std::abs(from_center.x) < half && std::abs(from_center.y) < half;
    ++(below ? count.below_block : count.beside_block);
  }
  return count;
}

TEST(PatchPoints, AreLeftOutUnderABlockThatStandsOnAFloor) {
  const FloorPoints points = points_on_floor(block_over_floor(0, 3));
  EXPECT_EQ(points.below_block, 0);
  EXPECT_GT(points.beside_block, 100);
}

TEST(PatchPoints, AreUniformOverArea) {
  const FloorPoints points = points_on_floor(block_over_floor(0.2, 3));
  const double all = points.below_block + points.beside_block;
  EXPECT_NEAR(points.below_block, 0.25 * all, 5 * std::sqrt(0.25 * 0.75 * all));
}

TEST(PatchPoints, AreInABlockThatHasALightInside) {
  EXPECT_GT(points_on_floor(block_over_floor(0, 0.5)).below_block, 30);
}

TEST(PatchPoints, AreLeftOutInAGap) {
  Scene scene = block_over_floor(0, 3);
  add_rectangle(scene, {-0.5, -0.5, 1e-3}, {1, 0, 0}, {0, 1, 0});
  scene.background.color = {1, 1, 1};
  EXPECT_EQ(points_on_floor(scene, 0.1).below_block, 0);
}

TEST(PatchPoints, AreLitThroughGlass) {
  Scene scene = block_over_floor(0, 3);
  for (std::size_t i = 1; i < scene.objects.size(); ++i) {
    Material& material = scene.materials[scene.objects[i].material.index];
    material.transmission = 1;
    material.diffuse = 0;
  }
  EXPECT_GT(points_on_floor(scene).below_block, 30);
}

}  // namespace
}  // namespace tracer
