// What must not change a picture: threads, the order of objects, where the world's origin is, its unit, its axes.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <random>

#include "tests/support/effort.h"
#include "tests/support/scenes.h"

namespace {

using namespace tracer;

/// Applies `point` to every place and `direction` to every direction; `length` scales radii and distances.
template <class Point, class Direction>
Scene mapped(Scene scene, const Point& point, const Direction& direction, double length) {
  scene.camera.position = point(scene.camera.position);
  scene.camera.look_at = point(scene.camera.look_at);
  scene.camera.up = direction(scene.camera.up);
  for (Light& light : scene.lights) {
    if (auto* p = std::get_if<PointLight>(&light.source)) p->position = point(p->position);
    if (auto* d = std::get_if<DirectionalLight>(&light.source)) d->direction = direction(d->direction);
    light.attenuation.coefficients[1] /= length;
    light.attenuation.coefficients[2] /= length * length;
    if (light.attenuation.kind == Attenuation::Kind::inverse_square) light.intensity *= length * length;
  }
  for (Object& object : scene.objects) {
    if (auto* sphere = std::get_if<Sphere>(&object.shape)) {
      sphere->center = point(sphere->center);
      sphere->radius *= length;
      sphere->axis = direction(sphere->axis);
      sphere->meridian = direction(sphere->meridian);
    }
    if (auto* plane = std::get_if<Plane>(&object.shape)) {
      plane->point = point(plane->point);
      plane->normal = direction(plane->normal);
      if (plane->u_axis) plane->u_axis = direction(*plane->u_axis);
      // A plane's texture is laid in scene units; each has a texture of its own.
      const ColorOrTexture& color = scene.materials[object.material.index].color;
      if (const auto* texture = std::get_if<TextureId>(&color)) {
        scene.textures[texture->index].scale.x /= length;
        scene.textures[texture->index].scale.y /= length;
      }
    }
    if (auto* triangle = std::get_if<Triangle>(&object.shape))
      for (Vec3& vertex : triangle->vertices) vertex = point(vertex);
    if (auto* mesh = std::get_if<Mesh>(&object.shape))
      for (Vec3& position : mesh->positions) position = point(position);
  }
  return scene;
}

Scene scaled(const Scene& scene, double s) {
  const auto times = [s](const Vec3& v) { return Vec3{v.x * s, v.y * s, v.z * s}; };
  return mapped(scene, times, times, s);
}

Scene moved(const Scene& scene, const Vec3& by) {
  const auto same = [](const Vec3& v) { return v; };
  return mapped(
      scene,
      [&](const Vec3& p) {
        return Vec3{p.x + by.x, p.y + by.y, p.z + by.z};
      },
      same, 1);
}

/// A random scene with a mesh and a triangle in it.
Scene varied(std::uint64_t seed, std::uint32_t side) {
  Scene scene = scenes::random(seed, side);
  Material shiny = scenes::matte({0.7, 0.6, 0.2});
  shiny.reflection = 0.3;
  scenes::add(scene, scenes::placed(scenes::icosphere(2, seed % 2 == 0), 0.8, {0.5, -0.25, 0.125}), shiny);
  scenes::add(scene, Triangle{{{{-3, -2, 0}, {0, -2, -3}, {0, 3, 0}}}, {}, {}}, shiny);
  return scene;
}

/// Pixels of which a channel differs by more than `codes` 8-bit steps.
std::uint64_t different(const Image& a, const Image& b, int codes) {
  const auto p = scenes::codes(a), q = scenes::codes(b);
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < p.size(); i += 3) {
    bool differs = false;
    for (std::size_t c = i; c < i + 3; ++c) differs |= std::abs(p[c] - q[c]) > codes;
    count += differs ? 1 : 0;
  }
  return count;
}

TEST(APicture, AndItsStatisticsAreTheSameBitsOnOneTwoAndSevenThreads) {
  // Seven also where there are fewer cores.
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 8);
  for (std::uint64_t seed = 1; seed <= effort::cases(12); ++seed) {
    Scene scene = varied(seed, 110);
    scene.accuracy.samples = 2;
    scene.accuracy.max_depth = 12;
    const Rendered one = scenes::render(scene, 1);
    for (const std::uint32_t threads : {2u, 7u, 0u}) {
      const Rendered many = scenes::render(scene, threads);
      ASSERT_EQ(many.image.rgb, one.image.rgb) << "seed " << seed << " threads " << threads;
      ASSERT_EQ(many.statistics, one.statistics);
    }
  }
}

TEST(APicture, DoesNotChangeWithTheOrderOfItsObjects) {
  for (std::uint64_t seed = 1; seed <= effort::cases(12); ++seed) {
    Scene scene = varied(seed, 64);
    const std::vector<float> image = scenes::render(scene).image.rgb;
    std::mt19937 shuffle(static_cast<unsigned>(seed));  // NOLINT: the same order every time
    for (int i = 0; i < 3; ++i) {
      std::shuffle(scene.objects.begin(), scene.objects.end(), shuffle);
      ASSERT_EQ(scenes::render(scene).image.rgb, image) << "seed " << seed;
    }
  }
}

TEST(APicture, OfSixteenSamplesIsTheSameBitsEachTimeAndDependsOnTheSeed) {
  Scene scene = varied(3, 40);
  scene.accuracy.samples = 16;
  const auto image = scenes::render(scene, 2).image.rgb;
  EXPECT_EQ(scenes::render(scene, 2).image.rgb, image);
  scene.accuracy.seed = 1;
  EXPECT_NE(scenes::render(scene, 2).image.rgb, image);
}

TEST(APicture, IsTheSameBitsForAWorldInUnitsOfAnyPowerOfTwo) {
  for (std::uint64_t seed = 1; seed <= effort::cases(12); ++seed) {
    Scene scene = varied(seed, 48);
    // What attenuation's coefficients would have to be in the most extreme units is over their limit.
    const bool faded = seed % 2 == 0;
    for (Light& light : scene.lights)
      if (!faded) light.attenuation = {};
    const Rendered rendered = scenes::render(scene);
    for (const int k : {faded ? -40 : -60, -23, -1, 1, 10, 37, faded ? 40 : 60}) {
      const Rendered other = scenes::render(scaled(scene, std::ldexp(1.0, k)));
      ASSERT_EQ(other.image.rgb, rendered.image.rgb) << "seed " << seed << " k " << k;
      ASSERT_EQ(other.statistics, rendered.statistics);
    }
  }
}

TEST(APicture, IsTheSameToACodeForAWorldInAnyUnit) {
  std::uint64_t edges = 0;
  const std::uint64_t count = effort::cases(12);
  for (std::uint64_t seed = 1; seed <= count; ++seed) {
    const Scene scene = varied(seed, 48);
    const Image image = scenes::render(scene).image;
    for (const double s : {1e-9, 1e-6, 0.001, 0.3, 10.0, 1e5, 1e9})
      edges += different(scenes::render(scaled(scene, s)).image, image, 1);
  }
  // Mesh corners are floats of the trace frame: where their silhouettes move by 2^-25, a pixel's centre may be passed.
  RecordProperty("edge_pixels", static_cast<int>(edges));
  EXPECT_LE(edges, count / 4 + 1) << "of " << count * 7 * 48 * 48 << " pixels";
}

/// Coordinates rounded to multiples of 2^-20, so that adding 10^9 is exact.
Scene coarse(Scene scene) {
  const auto rounded = [](double c) { return std::round(c * 0x1p20) * 0x1p-20; };
  const auto point = [&](const Vec3& p) { return Vec3{rounded(p.x), rounded(p.y), rounded(p.z)}; };
  scene = mapped(
      scene, point, [](const Vec3& v) { return v; }, 1);
  for (Object& object : scene.objects)
    if (auto* sphere = std::get_if<Sphere>(&object.shape)) sphere->radius = rounded(sphere->radius);
  return scene;
}

TEST(APicture, IsTheSameBitsWhereverTheWorldIsMoved) {
  for (std::uint64_t seed = 1; seed <= effort::cases(12); ++seed) {
    const Scene scene = coarse(varied(seed, 48));
    const Rendered rendered = scenes::render(scene);
    for (const Vec3& by : {Vec3{1e6, 0, 0}, Vec3{-1e6, 1e6, 1e3}, Vec3{1e9, -1e9, 2e9}, Vec3{3, 5, -7}}) {
      const Rendered other = scenes::render(moved(scene, by));
      ASSERT_EQ(other.image.rgb, rendered.image.rgb) << "seed " << seed << " by " << by.x << " " << by.y;
      ASSERT_EQ(other.statistics, rendered.statistics);
    }
  }
}

TEST(APicture, IsTheSameForAll48SymmetriesOfTheAxesAndMirroredWhereTheyMirror) {
  Scene scene = varied(6, 48);
  // Textures are laid right-handed: they alone do not mirror.
  for (Material& material : scene.materials)
    if (std::holds_alternative<TextureId>(material.color)) material.color = Color{0.8, 0.5, 0.3};
  const Image image = scenes::render(scene).image;
  std::array<int, 3> order{0, 1, 2};
  std::uint64_t edges = 0;
  do {
    for (int signs = 0; signs < 8; ++signs) {
      const auto map = [&](const Vec3& v) {
        const std::array<double, 3> from{v.x, v.y, v.z};
        std::array<double, 3> to{};
        for (int i = 0; i < 3; ++i) to[i] = (signs >> i & 1) != 0 ? -from[order[i]] : from[order[i]];
        return Vec3{to[0], to[1], to[2]};
      };
      const int inversions = (order[0] > order[1]) + (order[0] > order[2]) + (order[1] > order[2]);
      const bool mirrors = (inversions + (signs & 1) + (signs >> 1 & 1) + (signs >> 2)) % 2 != 0;
      Scene turned = mapped(scene, map, map, 1);
      if (mirrors) {
        // Fronts stay fronts.
        for (Object& object : turned.objects) {
          if (auto* triangle = std::get_if<Triangle>(&object.shape))
            std::swap(triangle->vertices[1], triangle->vertices[2]);
          if (auto* mesh = std::get_if<Mesh>(&object.shape))
            for (auto& corners : mesh->triangles) std::swap(corners[1], corners[2]);
        }
      }
      Image other = scenes::render(turned).image;
      if (mirrors) {
        for (std::uint32_t y = 0; y < other.height; ++y)
          for (std::uint32_t x = 0; x < other.width / 2; ++x)
            std::swap_ranges(other.rgb.begin() + 3 * (y * other.width + x),
                             other.rgb.begin() + 3 * (y * other.width + x + 1),
                             other.rgb.begin() + 3 * (y * other.width + other.width - 1 - x));
      }
      const std::uint64_t here = different(other, image, 1);
      EXPECT_LE(here, 3u) << "axes " << order[0] << order[1] << order[2] << " signs " << signs;
      edges += here;
    }
  } while (std::next_permutation(order.begin(), order.end()));
  RecordProperty("edge_pixels", static_cast<int>(edges));
}

}  // namespace
