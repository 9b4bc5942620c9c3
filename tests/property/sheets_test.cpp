// Stacks of sheets and solids that light passes straight through, against the product of their transmissions.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/support/scenes.h"
#include "tracer/src/math/vec.h"

namespace {

using namespace tracer;
using oracle::Random;

/// One layer of a stack along the z axis.
struct Layer {
  enum class Kind { disc, quad, triangle, ball, box, mesh } kind = Kind::disc;
  double z = 0;          ///< the middle
  double size = 1;       ///< across the stack
  bool flipped = false;  ///< the front of a sheet is towards -z
  MaterialId material;
};

bool is_solid(const Layer& layer) { return layer.kind >= Layer::Kind::ball; }

/// Two triangles around the axis, no edge through it.
Mesh quad(const Layer& layer) {
  const double s = layer.size, z = layer.z;
  Mesh mesh;
  mesh.positions = {{-s, -s, z}, {2 * s, -s, z}, {2 * s, 2 * s, z}, {-s, 2 * s, z}};
  mesh.triangles = {{0, 1, 3}, {1, 2, 3}};
  if (layer.flipped) mesh.triangles = {{0, 3, 1}, {1, 3, 2}};
  return mesh;
}

/// A closed mesh whose triangles have corners of their own.
Mesh faceted_ball(double radius, const Vec3& center) {
  const Mesh shared = scenes::placed(scenes::icosphere(1), radius, center);
  Mesh mesh;
  for (const auto& triangle : shared.triangles) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const std::uint32_t corner : triangle) mesh.positions.push_back(shared.positions[corner]);
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return mesh;
}

/// Solids are 0.6 thick, so that layers at distances of 1 do not touch.
Shape shape_of(const Layer& layer) {
  constexpr double half = 0.3;
  const double s = layer.size, z = layer.z;
  switch (layer.kind) {
    case Layer::Kind::disc:
      return Disc{{0.1, 0.2, z}, {0, 0, layer.flipped ? -1.0 : 1.0}, s, 0, {}};
    case Layer::Kind::quad:
      return quad(layer);
    case Layer::Kind::triangle:
      return Triangle{{Vec3{-s, -s, z}, Vec3{2 * s, -s, z}, Vec3{-s, 2 * s, z}}, {}, {}};
    case Layer::Kind::ball:
      return Sphere{{0, 0, z}, half};
    case Layer::Kind::box:
      return Box{{-s, -s, z - half}, {s, s, z + half}};
    case Layer::Kind::mesh:
      break;
  }
  return faceted_ball(half, {0.01, 0.02, z});
}

Material clear(Random& random, Material::Transparency transparency) {
  return {.color = Color{},
          .transmission = random.in(0.3, 1),
          .transmission_color = random.color(0.5),
          .transparency = transparency,
          .ior = 1,
          .path = {}};
}

struct Stack {
  std::vector<Material> materials;
  std::vector<Layer> layers;

  [[nodiscard]] Scene scene(double eye_z) const {
    Scene scene = scenes::empty(1, {{0.013, 0.017, eye_z}, {0.013, 0.017, 0}, {0, 1, 0}, 1e-3});
    scene.background.color = {1, 1, 1};
    scene.materials = materials;
    for (const Layer& layer : layers) scenes::add(scene, shape_of(layer), layer.material);
    return scene;
  }

  /// A ray passes each sheet once and each solid twice.
  [[nodiscard]] Color transmission() const {
    Color product{1, 1, 1};
    for (const Layer& layer : layers) {
      const Material& material = materials[layer.material.index];
      const Color once = std::get<Color>(material.transmission_color) * material.transmission;
      product = product * (is_solid(layer) ? once * once : once);
    }
    return product;
  }
};

/// Two to eight layers of three materials; some solids have a sheet inside.
Stack random_stack(Random& random) {
  using enum Material::Transparency;
  Stack stack;
  for (const auto transparency : {filtered, interpolated, refract})
    stack.materials.push_back(clear(random, transparency));
  const auto material = [&] { return MaterialId{random.below(3)}; };
  const auto size = [&] { return random.spread(0.4, 40); };
  const std::uint32_t count = 2 + random.below(7);
  for (std::uint32_t i = 0; i < count; ++i) {
    const auto kind = static_cast<Layer::Kind>(random.below(6));
    stack.layers.push_back({kind, static_cast<double>(i), size(), random.chance(0.5), material()});
    if (is_solid(stack.layers.back()) && random.chance(0.3))
      stack.layers.push_back({Layer::Kind::disc, i + 0.1, size(), random.chance(0.5), material()});
  }
  return stack;
}

std::vector<float> seen(const Stack& stack, double eye_z) { return scenes::render(stack.scene(eye_z)).image.rgb; }

/// Calls `check` with random stacks until one fails.
template <class Check>
void for_random_stacks(std::uint64_t seed, std::uint64_t count, const Check& check) {
  Random random(seed);
  for (std::uint64_t i = 0; i < effort::cases(count) && !testing::Test::HasFailure(); ++i) {
    SCOPED_TRACE("stack " + std::to_string(i));
    check(random_stack(random), random);
  }
}

void shuffle(std::vector<Layer>& layers, Random& random) {
  for (std::size_t i = layers.size(); i > 1; --i)
    std::swap(layers[i - 1], layers[random.below(static_cast<std::uint32_t>(i))]);
}

void expect_near(const std::vector<float>& rgb, const Color& expected) {
  EXPECT_NEAR(rgb[0], expected.r, 1e-6 * expected.r);
  EXPECT_NEAR(rgb[1], expected.g, 1e-6 * expected.g);
  EXPECT_NEAR(rgb[2], expected.b, 1e-6 * expected.b);
}

TEST(SheetStacks, TransmitTheProductOfTheirTransmissionsFromBothSides) {
  for_random_stacks(41, 400, [](const Stack& stack, Random& random) {
    for (const double eye_z : {-20.0, 30.0}) {
      const std::vector<float> rgb = seen(stack, eye_z);
      expect_near(rgb, stack.transmission());
      Stack permuted = stack;
      shuffle(permuted.layers, random);
      for (Layer& layer : permuted.layers) layer.size = random.spread(0.4, 40);
      EXPECT_EQ(seen(permuted, eye_z), rgb);
    }
  });
}

TEST(SheetStacks, PassTheProductToAWallThatALampBehindThemLights) {
  for_random_stacks(42, 200, [](const Stack& stack, Random&) {
    for (const double side : {-1.0, 1.0}) {
      // The eye is between the stack and the wall, the lamp behind the stack.
      const double wall_z = 4 + side * 16, eye_z = 4 + side * 10;
      Scene scene = stack.scene(eye_z);
      scene.camera.look_at.z = wall_z;
      scene.lights = {scenes::point_light({0.013, 0.017, 4 - side * 20})};
      scenes::add(scene, Plane{{0, 0, wall_z}, {0, 0, -side}, {}}, scenes::matte({1, 1, 1}));
      expect_near(scenes::render(scene).image.rgb, stack.transmission());
    }
  });
}

/// The stack before a glowing wall and black.
Scene before_a_glowing_wall(const Stack& stack) {
  Scene scene = stack.scene(30);
  scene.background.color = {};
  scenes::add(scene, Plane{{0, 0, -20}, {0, 0, 1}, {}}, scenes::glowing({1, 1, 1}));
  return scene;
}

TEST(SheetStacks, TransmitTheProductUnderGlobalLight) {
  for_random_stacks(43, 100, [](const Stack& stack, Random&) {
    Scene scene = before_a_glowing_wall(stack);
    scene.accuracy.model = Accuracy::Model::global;
    scene.materials.back().diffuse = 0.5;  // reflects nothing: all else is black
    expect_near(scenes::render(scene).image.rgb, stack.transmission());
  });
}

/// A wall of water or fog: what absorbs goes on behind a sheet in it.
TEST(SheetStacks, LeaveTheRayInItsMedium) {
  for_random_stacks(44, 50, [](Stack stack, Random& random) {
    std::erase_if(stack.layers, is_solid);
    if (stack.layers.empty()) return;
    const Color absorption = random.color(0.1);
    const auto expected = [&](double length) {
      return stack.transmission() * Color{std::exp(-absorption.r * length), std::exp(-absorption.g * length),
                                          std::exp(-absorption.b * length)};
    };
    Scene scene = before_a_glowing_wall(stack), fog = scene;
    fog.medium.absorption = absorption;
    expect_near(scenes::render(fog).image.rgb, expected(50));
    Material water;
    water.color = Color{};
    water.transmission = 1;
    water.ior = 1.33;
    water.absorption = absorption;
    scenes::add(scene, Box{{-1000, -1000, -9}, {1000, 1000, 15}}, water);
    expect_near(scenes::render(scene).image.rgb, expected(24));
  });
}

/// An open surface of another index bends light like a boundary, but hides nothing behind it.
TEST(SheetStacks, HideNothingBehindGlassSheets) {
  for_random_stacks(45, 200, [](Stack stack, Random& random) {
    for (Material& material : stack.materials) {
      material.transparency = Material::Transparency::refract;
      material.ior = random.in(1, 2);
    }
    // Light passes flat surfaces at right angles straight on.
    std::erase_if(stack.layers, [](const Layer& layer) { return is_solid(layer) && layer.kind != Layer::Kind::box; });
    for (const double eye_z : {-20.0, 30.0}) expect_near(seen(stack, eye_z), stack.transmission());
  });
}

}  // namespace
