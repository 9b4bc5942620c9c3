// Shapes of every kind, and edges in every direction.
#include <cmath>
#include <numbers>

#include "tests/statistics/scene_corpus.h"
#include "tests/support/random.h"

namespace statistics {
namespace {

using namespace tracer;
using scenes::matte;

Case ball() {
  Case c = lit_floor_case("ball", "one curved edge and the hard edge of its shadow");
  scenes::add(c.scene, Sphere{{0, 0.8, 0}, 0.8}, matte({0.8, 0.2, 0.1}));
  return c;
}

Case discs() {
  Case c = lit_floor_case("discs", "thin rings, seen from before and from the edge");
  for (int i = 0; i < 5; ++i) {
    const double angle = 0.35 * i;
    scenes::add(c.scene, Disc{{-2.0 + i, 0.9, 0}, {std::sin(angle * 1.2), 0, std::cos(angle * 1.2)}, 0.6, 0.1 * i, {}},
                matte({0.9, 0.2 * i, 0.1}));
  }
  return c;
}

Case round_bodies() {
  Case c = lit_floor_case("round_bodies", "cylinders and cones, open and capped");
  scenes::add(c.scene, Cylinder{{-2, 0, 0}, {-1.6, 1.6, 0.3}, 0.4, true, {}}, matte({0.7, 0.5, 0.2}));
  scenes::add(c.scene, Cylinder{{-0.6, 0.6, 0}, {0.2, 0.9, 1}, 0.45, false, {}}, matte({0.2, 0.5, 0.7}));
  scenes::add(c.scene, Cone{{1, 1.6, 0}, {1, 0, 0}, 0.5, 0, true, {}}, matte({0.2, 0.7, 0.3}));
  scenes::add(c.scene, Cone{{2.2, 1.1, 0}, {2, 0, 0}, 0.6, 0.25, false, {}}, matte({0.7, 0.2, 0.6}));
  scenes::add(c.scene, Torus{{0.1, 0.3, 1.6}, {0, 1, 0.3}, 0.4, 0.15, {}}, matte({0.8, 0.6, 0.2}));
  return c;
}

Case boxes() {
  Case c = lit_floor_case("boxes", "straight edges of turned boxes");
  for (int i = 0; i < 4; ++i) {
    scenes::add(c.scene, Box{{-0.4, 0, -0.4}, {0.4, 0.5 + 0.3 * i, 0.4}}, matte({0.3, 0.3 + 0.15 * i, 0.8}));
    c.scene.objects.back().transform = turned(23.0 * i, {-1.8 + 1.2 * i, 0, 0});
  }
  return c;
}

Case star() {
  Case c = empty_case("star", "edges in every direction: thin triangles around one point");
  for (int i = 0; i < 36; ++i) {
    const double a = 2 * std::numbers::pi * i / 36, b = a + 0.07;
    scenes::add(
        c.scene,
        Triangle{
            {{{0, 0.5, 0}, {2 * std::cos(a), 0.5 + 2 * std::sin(a), 0}, {2 * std::cos(b), 0.5 + 2 * std::sin(b), 0}}},
            {},
            {}},
        scenes::glowing({0.9, 0.8, 0.4}));
  }
  return c;
}

Case meshes() {
  Case c = lit_floor_case("meshes", "flat, smooth and gouraud meshes");
  scenes::add(c.scene, scenes::placed(scenes::torus(24, 12), 0.6, {-1.5, 0.9, 0}), matte({0.8, 0.6, 0.2}));
  scenes::add(c.scene, scenes::placed(scenes::icosphere(1, true), 0.7, {0.2, 0.8, 0}), phong({0.2, 0.5, 0.8}, 0.5, 40));
  Material gouraud = phong({0.3, 0.7, 0.3}, 0.6, 30);
  gouraud.shading = Material::Shading::gouraud;
  scenes::add(c.scene, scenes::placed(scenes::icosphere(2, true), 0.6, {1.8, 0.7, 0}), gouraud);
  return c;
}

Case instances() {
  Case c = lit_floor_case("instances", "prototypes within prototypes, turned and scaled");
  const MaterialId red = scenes::add(c.scene, matte({0.8, 0.2, 0.2})),
                   blue = scenes::add(c.scene, matte({0.2, 0.3, 0.9}));
  Prototype tree;
  tree.objects = {{Cylinder{{0, 0, 0}, {0, 0.5, 0}, 0.07, true, {}}, red, {}}, {Sphere{{0, 0.65, 0}, 0.25}, blue, {}}};
  Prototype row;
  for (int i = 0; i < 4; ++i) row.objects.push_back({Instance{{0}, {}}, {}, turned(30.0 * i, {0.6 * i, 0, 0})});
  c.scene.prototypes = {tree, row};
  for (int i = 0; i < 4; ++i)
    c.scene.objects.push_back({Instance{{1}, {}}, {}, turned(12.0 * i, {-1.4, 0, 1.5 - 1.1 * i}, 1 + 0.2 * i)});
  return c;
}

void add_flake(Scene& scene, MaterialId material, const Vec3& center, double radius, int levels) {
  scenes::add(scene, Sphere{center, radius}, material);
  if (levels == 0) return;
  for (int i = 0; i < 9; ++i) {
    const double height = i < 6 ? 0.1 : 0.75, around = i * std::numbers::pi / (i < 6 ? 3 : 1.5);
    const double flat = std::sqrt(1 - height * height), reach = radius * 4 / 3;
    add_flake(scene, material,
              {center.x + reach * flat * std::cos(around), center.y + reach * height,
               center.z + reach * flat * std::sin(around)},
              radius / 3, levels - 1);
  }
}

Case sphereflake() {
  Case c = lit_floor_case("sphereflake", "91 mirroring balls of three sizes");
  Material shiny = phong({0.6, 0.5, 0.4}, 0.3, 60);
  shiny.reflection = 0.4;
  add_flake(c.scene, scenes::add(c.scene, shiny), {0, 0.9, 0}, 0.7, 2);
  return c;
}

Case pebbles() {
  Case c = lit_floor_case("pebbles", "a thousand balls, most of them smaller than a pixel");
  oracle::Random draw(7);
  const MaterialId grey[] = {scenes::add(c.scene, matte({0.9, 0.85, 0.8})),
                             scenes::add(c.scene, matte({0.15, 0.1, 0.1}))};
  for (int i = 0; i < 1000; ++i) {
    const double radius = draw.spread(0.01, 0.09);
    scenes::add(c.scene, Sphere{{draw.in(-4, 4), radius, draw.in(-9, 3)}, radius}, grey[i % 2]);
  }
  return c;
}

Case lattice() {
  Case c = empty_case("lattice", "bars finer than a pixel, far away and near");
  c.scene.lights.push_back(scenes::directional_light({0.3, -1, -0.5}));
  const MaterialId bar = scenes::add(c.scene, matte({0.9, 0.9, 0.9}));
  for (int i = 0; i < 25; ++i) {
    const double x = 0.25 * (i - 12);
    scenes::add(c.scene, Cylinder{{x, 0.2, 2}, {x, 0.6, -30}, 0.03, false, {}}, bar);
    scenes::add(c.scene, Cylinder{{-3, 1.2, x}, {3, 1.3, x}, 0.015, false, {}}, bar);
  }
  return c;
}

}  // namespace

std::vector<Case> shape_cases() {
  return {ball(), discs(), round_bodies(), boxes(), star(), meshes(), instances(), sphereflake(), pebbles(), lattice()};
}

}  // namespace statistics
