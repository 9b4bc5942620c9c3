// The live form: its hierarchy holds every primitive once, and its tables have the scene's numbers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "tests/support/scenes.h"
#include "tracer/live.h"
#include "tracer/src/live/live_bvh.h"

namespace tracer {
namespace {

LivePrimitive box(float number, const Vec3& low, double size) {
  const auto x = static_cast<float>(low.x), y = static_cast<float>(low.y), z = static_cast<float>(low.z);
  const auto side = static_cast<float>(size);
  return {{x, y, z}, {x + side, y + side, z + side}, {number, 0, 0, 0}};
}

/// Visits the tree; returns the nodes above the deepest leaf, and counts the primitives by their first number.
std::uint32_t visit(const LiveBvh& bvh, const std::vector<LivePrimitive>& boxes, std::size_t node,
                    std::vector<int>& seen) {
  const float* const at = &bvh.nodes.at(8 * node);
  const auto first = static_cast<std::size_t>(at[3]), count = static_cast<std::size_t>(at[7]);
  if (count == 0) {
    EXPECT_GT(first, node + 1);
    return 1 + std::max(visit(bvh, boxes, node + 1, seen), visit(bvh, boxes, first, seen));
  }
  for (std::size_t i = first; i < first + count; ++i) {
    const auto number = static_cast<std::size_t>(bvh.primitives.at(4 * i));
    ++seen.at(number);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_LE(at[axis], boxes[number].low[axis]);
      EXPECT_GE(at[4 + axis], boxes[number].high[axis]);
    }
  }
  return 0;
}

TEST(LiveBvh, HoldsEachPrimitiveOnceBelowTheLargestDepth) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  const auto anywhere = [&](int) { return Vec3{unit(random), unit(random), unit(random)}; };
  const std::function<Vec3(int)> places[] = {anywhere,
                                             [](int) {
                                               return Vec3{1, 2, 3};
                                             },  // all at one place
                                             [](int i) {
                                               return Vec3{std::ldexp(1.0, -(i % 120)), 0, 0};
                                             },  // each half as far as the last
                                             [](int i) {
                                               return Vec3{std::ldexp(1.0, i % 120), std::ldexp(-1.0, i % 7), 0};
                                             },
                                             [](int i) {
                                               return Vec3{1.0 * i, 0, 0};
                                             }};
  for (const auto& place : places)
    for (const int count : {0, 1, 2, 5, 1000, 20'000}) {
      std::vector<LivePrimitive> boxes;
      for (int i = 0; i < count; ++i) boxes.push_back(box(static_cast<float>(i), place(i), 1e-3));
      const LiveBvh bvh = build_live_bvh(boxes);
      std::vector<int> seen(boxes.size());
      EXPECT_LE(count > 0 ? visit(bvh, boxes, 0, seen) : 0, live_bvh_depth_max);
      EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), count);
      EXPECT_EQ(bvh.primitives.size(), 4 * boxes.size());
    }
}

Result<LiveScene, std::string> live_of(const Scene& scene, const LiveLimits& limits = {}) {
  RenderControl control;
  const auto compiled = compile(scene, control);
  if (!compiled) return compiled.error().detail;
  return live_scene(scene, **compiled, limits);
}

TEST(LiveScene, HasTheNumbersOfTheDocument) {
  Scene scene = scenes::empty(8);
  Material material = scenes::mirror(0.25);
  material.color = Color{0.1, 0.2, 0.3};
  material.shininess = 77;
  scenes::add(scene, Sphere{{100, 20, -3}, 4}, material);
  scenes::add(scene, Cylinder{{90, 0, 0}, {90, 8, 0}, 2, true, {}}, scenes::glass(1.4));
  scenes::add(scene, scenes::icosphere(2), scenes::matte({1, 1, 1}));
  scene.lights.push_back(scenes::point_light({80, 30, 5}));
  const auto live = live_of(scene);
  ASSERT_TRUE(live) << live.error();
  const auto world = [&](const std::vector<float>& table, std::size_t cell) {
    return Vec3{table.at(4 * cell) / live->scale + live->origin.x,
                table.at(4 * cell + 1) / live->scale + live->origin.y,
                table.at(4 * cell + 2) / live->scale + live->origin.z};
  };
  EXPECT_NEAR(world(live->shapes, 0).x, 100, 1e-4);
  EXPECT_NEAR(world(live->shapes, 1).y, 0, 1e-4);  // the cylinder's origin
  EXPECT_NEAR(live->shapes.at(3) / live->scale, 4, 1e-5);
  EXPECT_NEAR(world(live->lights, 0).y, 30, 1e-4);
  const auto material_number = [&](std::size_t row, std::string_view field) {
    const auto found = std::ranges::find(live->material_fields, field, [](const auto& each) { return each.first; });
    return live->materials.at(4 * live->material_cells * row + found->second);
  };
  EXPECT_FLOAT_EQ(material_number(0, "color"), 0.1F);
  EXPECT_FLOAT_EQ(material_number(0, "reflection"), 0.25F);
  EXPECT_FLOAT_EQ(material_number(0, "shininess"), 77);
  EXPECT_FLOAT_EQ(material_number(1, "ior"), 1.4F);
  EXPECT_EQ(live->materials.size(), 4 * live->material_cells * 3);
  EXPECT_FLOAT_EQ(live->objects.at(5), 8);  // a closed boundary
  EXPECT_EQ(live->primitives.size() / 4, 2 + 20 * 16);
  EXPECT_TRUE(live->omitted.empty());
}

TEST(LiveScene, NamesWhatItLeavesOut) {
  Scene scene = scenes::empty(8);
  EXPECT_TRUE(leave_out(scene).empty());
  scene.accuracy.model = Accuracy::Model::global;
  scene.accuracy.approximate.shadows = Approximations::Shadows::map;
  scene.camera.layout = Camera::Layout::anaglyph;
  scene.image.crop = PixelWindow{0, 0, 1, 1};
  scene.output.overflow = Output::Overflow::scale;
  scene.output.palette = 16;
  Material material = scenes::matte({1, 1, 1});
  material.shading = Material::Shading::gouraud;
  material.path = "/materials/m";
  scenes::add(scene, Sphere{}, material);
  std::vector<std::string> pointers;
  for (const LiveOmission& omission : leave_out(scene)) pointers.push_back(omission.pointer);
  EXPECT_EQ(pointers,
            (std::vector<std::string>{"/accuracy/model", "/accuracy/approximate", "/camera/layout", "/image/crop",
                                      "/output/overflow", "/output/palette", "/materials/m/shading"}));
  EXPECT_FALSE(scene.accuracy.approximate.any());
  scenes::add(scene, Sphere{{1, 0, 0}, 1e-7}, material);
  EXPECT_EQ(live_of(scene)->omitted.at(0).pointer, "/objects");
}

TEST(LiveScene, RefusesWhatExceedsItsLimitsOrFloats) {
  Scene scene = scenes::empty(8);
  scenes::add(scene, scenes::icosphere(4), scenes::matte({1, 1, 1}));
  EXPECT_TRUE(live_of(scene));
  EXPECT_NE(live_of(scene, {.cells = 1000}).error().find("1000 cells, nodes has "), std::string::npos);
  EXPECT_NE(live_of(scene, {.bytes = 4000}).error().find("the limit of the live view is 4000 bytes"),
            std::string::npos);
  scene.lights.push_back(scenes::point_light({1e50, 0, 0}));
  EXPECT_EQ(live_of(scene).error(), "a number of lights exceeds the range of 32-bit floats, which the live view has");
  scene.lights.clear();
  scenes::add(scene, Plane{{0, 1e45, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
  EXPECT_NE(live_of(scene).error().find("planes"), std::string::npos);
}

}  // namespace
}  // namespace tracer
