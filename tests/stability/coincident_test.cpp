// Coincident surfaces: the same one of them is always visible.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <random>

#include "tests/stability/table.h"
#include "tests/support/effort.h"
#include "tests/support/random.h"

namespace {

using oracle::Random;
using namespace tracer;
using stability::compare;
using stability::Oracle;
using stability::Row;

std::vector<Shape> shapes() {
  return {Plane{{0, -2, 0}, {0, 1, 0.1}, {}},
          Sphere{{-1.5, 0, 0}, 0.7},
          Box{{0.5, -0.5, -0.5}, {1.5, 0.5, 0.5}},
          Disc{{0, 1.3, 0}, {0, 1, 1}, 0.8, 0.2, {}},
          Cylinder{{2, -1, 0}, {2, 1, 0.3}, 0.4, true, {}},
          Cone{{-0.3, 0.5, 1}, {-0.3, -1, 1}, 0.5, 0.1, true, {}},
          Triangle{{{{-3, -1, -1}, {3, -1, -1.5}, {0, 3, -1}}}, {}, {}},
          scenes::placed(scenes::icosphere(2), 0.5, {0.2, -0.6, 1.5})};
}

/// Every shape `copies` times, each copy of another color, and random spheres between them.
Scene stacked(int copies, std::uint64_t seed) {
  Random random(seed);
  Scene scene = scenes::empty(64, {{0.5, 1, 7}, {0, 0, 0}, {0, 1, 0}, 45});
  scene.lights = {scenes::point_light({3, 5, 6}), scenes::directional_light({1, -1, -1})};
  for (int copy = 0; copy < copies; ++copy) {
    Material material = scenes::matte(copy == 0 ? Color{0.9, 0.2, 0.1} : Color{0.1, 0.9, 0.2});
    material.reflection = 0.2;
    const MaterialId id = scenes::add(scene, material);
    for (Shape& shape : shapes()) scenes::add(scene, std::move(shape), id);
  }
  for (int i = 0; i < 40; ++i) scenes::add(scene, Sphere{random.vector(2), random.spread(0.02, 0.2)}, MaterialId{0});
  return scene;
}

TEST(CoincidentSurfaces, ShowTheFirstOne) {
  Row row(14, "coincident copies of every shape: the first alone is seen", Oracle::invariance, "pixels");
  for (std::uint64_t seed = 1; seed <= effort::cases(8); ++seed)
    compare(row, stability::render(stacked(3, seed)).image, stability::render(stacked(1, seed)).image);
}

TEST(CoincidentSurfaces, AreTheSameForAnyThreadsAndAnyTree) {
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 8);
  Row row(14, "coincident shapes: threads, and trees of other spheres in other orders", Oracle::invariance, "pixels");
  for (std::uint64_t seed = 1; seed <= effort::cases(8); ++seed) {
    Scene scene = stacked(2, seed);
    const Image expected = stability::render(scene, 1).image;
    for (const std::uint32_t threads : {2u, 7u}) compare(row, stability::render(scene, threads).image, expected);
    std::mt19937 shuffle(static_cast<unsigned>(seed));  // NOLINT: the same order every time
    for (int i = 0; i < 3; ++i) {
      // Inserts the spheres at random positions among the copies, which keep their order.
      std::vector<Object> copies, spheres;
      for (const Object& object : scene.objects) {
        const auto* sphere = std::get_if<Sphere>(&object.shape);
        (sphere != nullptr && sphere->radius < 0.3 ? spheres : copies).push_back(object);
      }
      std::shuffle(spheres.begin(), spheres.end(), shuffle);
      scene.objects.clear();
      while (!copies.empty() || !spheres.empty()) {
        std::vector<Object>& from = spheres.empty() || (!copies.empty() && shuffle() % 4 == 0) ? copies : spheres;
        scene.objects.push_back(from.front());
        from.erase(from.begin());
      }
      compare(row, stability::render(scene, 2).image, expected);
    }
  }
}

TEST(CoplanarSurfaces, ThatOnlyOverlapAreTheSameForAnyThreadsAndAnyTree) {
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 8);
  Row row(14, "coplanar triangles, discs, planes: threads, triangles in any order", Oracle::invariance, "pixels");
  for (std::uint64_t seed = 1; seed <= effort::cases(8); ++seed) {
    Random random(seed);
    Scene scene = scenes::empty(64, {{0.5, 3, 4}, {0, 0, 0}, {0, 1, 0}, 45});
    scene.ambient = {1, 1, 1};
    Mesh sheet;
    for (std::uint32_t i = 0; i < 90; ++i) {
      const auto grid = [&] { return std::round(random.in(-32, 32)) / 16; };  // coplanar to the last bit
      sheet.positions.push_back({grid(), 0, grid()});
      if (i % 3 == 2) sheet.triangles.push_back({i - 2, i - 1, i});
    }
    scenes::add(scene, sheet, scenes::matte({0.2, 0.4, 0.6}));
    scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({0.9, 0.4, 0.1}));
    scenes::add(scene, Disc{{0, 0, 0}, {0, 1, 0}, 1.2, 0.5, {}}, scenes::matte({0.1, 0.8, 0.1}));
    scenes::add(scene, Box{{-1.5, -1, -1.5}, {-0.5, 0, -0.5}}, scenes::matte({0.8, 0.1, 0.8}));
    const Image expected = stability::render(scene, 1).image;
    std::mt19937 shuffle(static_cast<unsigned>(seed));  // NOLINT: the same order every time
    for (const std::uint32_t threads : {2u, 7u}) {
      auto& mesh = std::get<Mesh>(scene.objects[0].shape);
      std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), shuffle);
      compare(row, stability::render(scene, threads).image, expected);
    }
  }
}

}  // namespace
