// Invariance of images under threads, the order of objects, the origin, unit and axes of world space, and the caller's
// flush-to-zero mode.
#include <gtest/gtest.h>
#include <immintrin.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <functional>
#include <random>

#include "tests/stability/table.h"
#include "tests/support/effort.h"
#include "tracer/src/math/vec.h"

namespace {

using namespace tracer;
using stability::Oracle;
using stability::Row;

constexpr ColorOrTexture Material::*colors[] = {&Material::color,
                                                &Material::specular_color,
                                                &Material::emission,
                                                &Material::reflection_color,
                                                &Material::transmission_color,
                                                &Material::diffuse_transmission_color,
                                                &Material::opacity};

/// Applies `point` to every point and `direction` to every direction; `length` scales radii and distances.
template <class Point, class Direction>
Scene mapped(Scene scene, const Point& point, const Direction& direction, double length) {
  scene.camera.position = point(scene.camera.position);
  scene.camera.look_at = point(scene.camera.look_at);
  scene.camera.up = direction(scene.camera.up);
  scene.background.up = direction(*scene.background.up);
  for (Light& light : scene.lights) {
    if (auto* p = std::get_if<PointLight>(&light.source)) p->position = point(p->position);
    if (auto* d = std::get_if<DirectionalLight>(&light.source)) d->direction = direction(d->direction);
    light.attenuation.coefficients[1] /= length;
    light.attenuation.coefficients[2] /= length * length;
    const bool fades = !std::holds_alternative<DirectionalLight>(light.source);
    if (fades && light.attenuation.kind == Attenuation::Kind::inverse_square) light.intensity *= length * length;
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
      for (const auto color : colors) {
        const auto* texture = std::get_if<TextureId>(&(scene.materials[object.material.index].*color));
        if (texture == nullptr) continue;
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
  const auto times = [s](const Vec3& v) { return v * s; };
  return mapped(scene, times, times, s);
}

Scene moved(const Scene& scene, const Vec3& by) {
  return mapped(
      scene, [&](const Vec3& p) { return p + by; }, std::identity(), 1);
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

/// Adds the pixels of `image` that differ from `expected` by more than `codes` 8-bit steps. Pixels whose path in
/// `scene` passes an edge with a margin below 2^-20 in the second tracer are undecided: vertices of meshes are floats
/// in render space.
void compare(Row& row, const Scene& scene, const Image& image, const Image& expected, int codes) {
  const auto p = scenes::codes(image), q = scenes::codes(expected);
  row.count(p.size() / 3, 0);
  for (std::size_t i = 0; i < p.size(); i += 3) {
    bool differs = false;
    for (std::size_t c = i; c < i + 3; ++c) differs |= std::abs(p[c] - q[c]) > codes;
    if (!differs) continue;
    RenderStatistics ignored;
    const std::size_t x = i / 3 % image.width, y = i / 3 / image.width;
    const auto sample = oracle::ReferenceTracer(scene).sample(oracle::Real(x) + 0.5L, oracle::Real(y) + 0.5L, ignored);
    if (sample.margin < 0x1p-20L) {
      row.undecided();
    } else {
      row.count(0, 1, "pixel " + std::to_string(x) + " " + std::to_string(y));
    }
  }
}

constexpr std::string_view near_edge = "the path passes an edge by less than 2^-20, and mesh corners are floats";

TEST(ImageInvariance, HoldsForAnyNumberOfThreads) {
  // Seven also where there are fewer cores.
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 8);
  Row row(26, "1, 2, 7 and all threads", Oracle::invariance, "pixels");
  for (std::uint64_t seed = 1; seed <= effort::cases(12); ++seed) {
    Scene scene = varied(seed, 110);
    scene.accuracy.samples = 2;
    scene.accuracy.max_depth = 12;
    const Rendered one = stability::render(scene, 1);
    for (const std::uint32_t threads : {2u, 7u, 0u}) {
      const Rendered many = stability::render(scene, threads);
      stability::compare(row, many.image, one.image, "seed " + std::to_string(seed));
      ASSERT_EQ(many.statistics, one.statistics);
    }
  }
}

TEST(ImageInvariance, HoldsForAnyOrderOfObjects) {
  Row row(14, "objects in any order", Oracle::invariance, "pixels");
  for (std::uint64_t seed = 1; seed <= effort::cases(12); ++seed) {
    Scene scene = varied(seed, 64);
    const Image image = stability::render(scene).image;
    std::mt19937 shuffle(static_cast<unsigned>(seed));  // NOLINT: the same order every time
    for (int i = 0; i < 3; ++i) {
      std::shuffle(scene.objects.begin(), scene.objects.end(), shuffle);
      stability::compare(row, stability::render(scene).image, image, "seed " + std::to_string(seed));
    }
  }
}

TEST(ImageInvariance, IsExactForUnitsOfAnyPowerOfTwo) {
  Row row(1, "scaled by 2^-60 .. 2^60: the same bits", Oracle::invariance, "pixels");
  for (std::uint64_t seed = 1; seed <= effort::cases(12); ++seed) {
    Scene scene = varied(seed, 48);
    // What attenuation's coefficients would have to be in the most extreme units is over their limit.
    const bool faded = seed % 2 == 0;
    for (Light& light : scene.lights)
      if (!faded) light.attenuation = {};
    const Rendered rendered = stability::render(scene);
    for (const int k : {faded ? -40 : -60, -23, -1, 1, 10, 37, faded ? 40 : 60}) {
      const Rendered other = stability::render(scaled(scene, std::ldexp(1.0, k)));
      stability::compare(row, other.image, rendered.image, "seed " + std::to_string(seed));
      ASSERT_EQ(other.statistics, rendered.statistics);
    }
  }
}

TEST(ImageInvariance, IsWithinOneCodeValueForAnyUnit) {
  Row row(1, "scaled by 1e-9 .. 1e9: the same to 1 code value", Oracle::invariance, "pixels");
  row.bound(near_edge, 1e-4);
  for (std::uint64_t seed = 1; seed <= effort::cases(12); ++seed) {
    const Scene scene = varied(seed, 48);
    const Image image = stability::render(scene).image;
    for (const double s : {1e-9, 1e-6, 0.001, 0.3, 10.0, 1e5, 1e9})
      compare(row, scene, stability::render(scaled(scene, s)).image, image, 1);
  }
}

/// Coordinates rounded to multiples of `grain`, so that adding some large number is exact.
Scene coarse(Scene scene, double grain) {
  const auto rounded = [grain](double c) { return std::round(c / grain) * grain; };
  const auto point = [&](const Vec3& p) { return Vec3{rounded(p.x), rounded(p.y), rounded(p.z)}; };
  scene = mapped(scene, point, std::identity(), 1);
  for (Object& object : scene.objects)
    if (auto* sphere = std::get_if<Sphere>(&object.shape)) sphere->radius = std::max(grain, rounded(sphere->radius));
  return scene;
}

TEST(ImageInvariance, IsExactForTranslatedScenes) {
  Row near(2, "moved by up to 1e9, in multiples of 2^-20", Oracle::invariance, "pixels");
  Row far(2, "moved by up to 1e12, in multiples of 2^-12 as doubles have", Oracle::invariance, "pixels");
  for (std::uint64_t seed = 1; seed <= effort::cases(12); ++seed) {
    const auto compare_moved = [&](Row& row, double grain, const std::vector<Vec3>& places) {
      const Scene scene = coarse(varied(seed, 48), grain);
      const Rendered rendered = stability::render(scene);
      for (const Vec3& by : places) {
        const Rendered other = stability::render(moved(scene, by));
        stability::compare(row, other.image, rendered.image, "seed " + std::to_string(seed));
        ASSERT_EQ(other.statistics, rendered.statistics);
      }
    };
    compare_moved(near, 0x1p-20, {{1e6, 0, 0}, {-1e6, 1e6, 1e3}, {1e9, -1e9, 2e9}, {3, 5, -7}});
    compare_moved(far, 0x1p-12, {{1e12, 0, 0}, {-1e12, 3e11, 1e12}});
  }
}

TEST(ImageInvariance, HoldsForAll48SymmetriesOfTheAxes) {
  Row row(3, "the 48 symmetries of the axes", Oracle::invariance, "pixels");
  row.bound(near_edge, 1e-3);
  Scene scene = varied(6, 48);
  // Textures are laid right-handed: they alone do not mirror.
  for (Material& material : scene.materials)
    for (const auto color : colors)
      if (std::holds_alternative<TextureId>(material.*color)) material.*color = Color{0.8, 0.5, 0.3};
  const Image image = stability::render(scene).image;
  std::array<int, 3> order{0, 1, 2};
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
      Image other = stability::render(turned).image;
      if (mirrors) {
        for (std::uint32_t y = 0; y < other.height; ++y)
          for (std::uint32_t x = 0; x < other.width / 2; ++x)
            std::swap_ranges(other.rgb.begin() + 3 * (y * other.width + x),
                             other.rgb.begin() + 3 * (y * other.width + x + 1),
                             other.rgb.begin() + 3 * (y * other.width + other.width - 1 - x));
      }
      compare(row, scene, other, image, 1);
    }
  } while (std::next_permutation(order.begin(), order.end()));
}

/// As varied(), with a mesh and a triangle that glow.
Scene varied_globally(std::uint64_t seed, std::uint32_t side) {
  Scene scene = varied(seed, side);
  scenes::light_globally(scene);
  scene.materials.back().emission = Color{0.4, 0.6, 0.9};
  scene.accuracy.samples = 4;
  return scene;
}

TEST(ImageInvariance, HoldsUnderGlobalLight) {
  const tbb::global_control allow(tbb::global_control::max_allowed_parallelism, 8);
  Row threads(26, "global light: 1, 2 and 8 threads, windows of the image", Oracle::invariance, "pixels");
  Row scales(1, "global light: scaled by 2^-40 .. 2^40: the same bits", Oracle::invariance, "pixels");
  Row places(2, "global light: moved by up to 1e9, in multiples of 2^-20", Oracle::invariance, "pixels");
  std::uint64_t diffuse = 0;
  for (std::uint64_t seed = 1; seed <= effort::cases(6); ++seed) {
    Scene scene = coarse(varied_globally(seed, 48), 0x1p-20);
    using enum Approximations::Interreflection;
    scene.accuracy.approximate.interreflection = std::array{exact, radiosity, gather}[seed % 3];
    const Rendered one = stability::render(scene, 1);
    diffuse += one.statistics.rays.diffuse;
    ASSERT_TRUE(requirements(scene).emitters);
    const auto compare_with = [&](Row& row, const Scene& other, std::uint32_t count) {
      const Rendered rendered = stability::render(other, count);
      stability::compare(row, rendered.image, one.image, "seed " + std::to_string(seed));
      EXPECT_EQ(rendered.statistics, one.statistics);
    };
    for (const std::uint32_t count : {2u, 8u}) compare_with(threads, scene, count);
    for (const int k : {-40, -7, 1, 40}) compare_with(scales, scaled(scene, std::ldexp(1.0, k)), 0);
    for (const Vec3& by : {Vec3{1e6, 0, 0}, Vec3{1e9, -1e9, 2e9}}) compare_with(places, moved(scene, by), 0);
    scene.image.crop = PixelWindow{5, 6, 41, 29};
    const Image part = stability::render(scene, 2).image;
    Image expected{part.width, part.height, {}};
    for (std::uint32_t y = 6; y < 29; ++y)
      expected.rgb.insert(expected.rgb.end(), one.image.pixel(5, y), one.image.pixel(5, y) + 3 * part.width);
    stability::compare(threads, part, expected, "seed " + std::to_string(seed));
  }
  EXPECT_GT(diffuse, 1'000u);
}

/// Sets FTZ and DAZ on this thread during its lifetime.
class Flushing {
 public:
  Flushing() : before_(_mm_getcsr()) { _mm_setcsr(before_ | 0x8040U); }
  ~Flushing() { _mm_setcsr(before_); }
  Flushing(const Flushing&) = delete;
  Flushing& operator=(const Flushing&) = delete;

 private:
  unsigned before_;
};

/// A scene in units of `size`, with mirrors whose throughput underflows.
Scene fading(std::uint64_t seed, double size) {
  Scene scene = scenes::random(seed, 40);
  for (Object& object : scene.objects)
    object.transform = Transform{{{{size, 0, 0, 0}, {0, size, 0, 0}, {0, 0, size, 0}}}};
  scene.camera.position = scene.camera.position * size;
  scene.camera.look_at = scene.camera.look_at * size;
  for (Light& light : scene.lights)
    if (auto* point = std::get_if<PointLight>(&light.source)) point->position = point->position * size;
  scene.accuracy.cutoff = 0;
  scenes::add(scene, scenes::placed(scenes::icosphere(2, true), 0.8 * size, {0, 0, 0}), scenes::mirror(1e-30));
  return scene;
}

TEST(FlushingDenormals, ChangesNoBitOfAnImage) {
  Row row(20, "denormals flushed to zero, or not: the same bits", Oracle::invariance, "pixels");
  for (std::uint64_t seed = 1; seed <= effort::cases(10); ++seed)
    for (const double size : {1e-50, 1.0, 1e50})
      for (const std::uint32_t threads : {1u, 2u}) {
        const Scene scene = fading(seed, size);
        const Image expected = stability::render(scene, threads).image;
        const Flushing flushing;
        stability::compare(row, stability::render(scene, threads).image, expected,
                           "seed " + std::to_string(seed) + " size " + std::to_string(size));
      }
}

}  // namespace
