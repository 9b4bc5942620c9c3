// A hundred thousand lights, a hundred thousand instances: the image does not depend on their order.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "tests/stability/table.h"
#include "tests/support/random.h"

namespace {

using oracle::Random;
using namespace tracer;
using stability::Oracle;
using stability::Row;

constexpr std::uint32_t many = 100'000;

TEST(HundredThousandLights, SumToTheSameFloatInAnyOrder) {
  Row row(22, "1e5 lamps: the sum in any order, to 1 ulp", Oracle::invariance, "values");
  Random random(1);
  Scene scene = scenes::empty(3, {{0, 3, 6}, {0, 0, 0}, {0, 1, 0}, 40});
  Material glossy = scenes::matte({0.7, 0.5, 0.3});
  glossy.model = Material::Model::blinn_phong;
  glossy.specular = 0.4;
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, glossy);
  scenes::add(scene, Sphere{{0, 1, 0}, 1}, glossy);
  for (std::uint32_t i = 0; i < many; ++i) {
    Vec3 place = random.vector(9);
    place.y = std::abs(place.y) + 2.5;
    scene.lights.push_back(scenes::point_light(place, random.color()));
    scene.lights.back().intensity = random.spread(1e-9, 1e-3);
  }
  const auto expected = stability::render(scene).image.rgb;
  // NOLINTNEXTLINE: the same order every time
  std::mt19937 shuffle(1);
  for (int order = 0; order < 4; ++order) {
    if (order == 0) std::reverse(scene.lights.begin(), scene.lights.end());
    if (order == 1) std::ranges::sort(scene.lights, {}, &Light::intensity);
    if (order > 1) std::shuffle(scene.lights.begin(), scene.lights.end(), shuffle);
    const auto image = stability::render(scene).image.rgb;
    for (std::size_t i = 0; i < image.size(); ++i)
      row.expect(image[i] > 0 && std::fabs(image[i] - expected[i]) <= expected[i] * 0x1p-23F);
  }
}

TEST(HundredThousandInstances, EqualCopiesInAnyOrder) {
  Row shuffled(22, "1e5 instances in any order: the same bits", Oracle::invariance, "pixels");
  Row flattened(22, "1e5 instances beside 1e5 copies: the same bits", Oracle::invariance, "pixels");
  Random random(2);
  Scene scene = scenes::empty(64, {{0, 0, 40}, {0, 0, 0}, {0, 1, 0}, 40});
  scene.lights = {scenes::directional_light({-1, -1, -1}), scenes::point_light({3, 4, 30})};
  const MaterialId red = scenes::add(scene, scenes::matte({0.7, 0.3, 0.2}));
  Scene flat = scene;
  const Sphere ball{{0.1, 0, 0}, 0.08};
  const Box block{{-0.1, -0.1, -0.1}, {0.05, 0.1, 0.1}};
  scene.prototypes.push_back({{{ball, red, {}}, {block, red, {}}}, "/prototypes/p"});
  for (std::uint32_t i = 0; i < many; ++i) {
    const Vec3 to = random.vector(12);
    const double size = random.spread(0.2, 3);
    const Transform placed{{{{size, 0, 0, to.x}, {0, size, 0, to.y}, {0, 0, size, to.z}}}};
    scene.objects.push_back({Instance{{0}, {}}, {}, placed});
    flat.objects.push_back({ball, red, placed});
    flat.objects.push_back({block, red, placed});
  }
  const Image expected = stability::render(scene, 2).image;
  stability::compare(flattened, stability::render(flat, 2).image, expected);
  std::mt19937 shuffle(1);  // NOLINT: the same order every time
  std::shuffle(scene.objects.begin(), scene.objects.end(), shuffle);
  stability::compare(shuffled, stability::render(scene, 2).image, expected);
}

}  // namespace
