// Extreme input: sizes and distances, infinite reflections, unbounded radiance, exponents from 0 to 1e308, slats
// thinner than a pixel.
#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "tests/stability/table.h"
#include "tests/support/effort.h"
#include "tests/support/memory_growth.h"

namespace {

using oracle::Real;
using namespace tracer;
using stability::Oracle;
using stability::Row;

/// Two parallel emissive mirrors, and one pixel that looks from one at the other.
Scene corridor(double rho, std::uint32_t depth) {
  Scene scene = scenes::empty(2, {{0, 0, 0.25}, {0, 0, 1}, {0, 1, 0}, 1});
  Material wall = scenes::mirror(rho);
  wall.emission = Color{1, 0.5, 0.25};
  const MaterialId material = scenes::add(scene, wall);
  scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, material);
  scenes::add(scene, Plane{{0, 0, 1}, {0, 0, -1}, {}}, material);
  scene.accuracy.max_depth = depth;
  return scene;
}

TEST(MirrorCorridor, SumsTheGeometricSeriesToAnyDepth) {
  Row row(21, "mirror corridor: E (1 - rho^(n+1)) / (1 - rho)", Oracle::closed_form, "pixels");
  for (const double rho : {0.5, 0.9, 0.999, 0.99999})
    for (const std::uint32_t depth : {0u, 1u, 10u, 1000u, 20'000u}) {
      const Rendered rendered = stability::render(corridor(rho, depth));
      const auto expected = static_cast<double>((1 - std::pow(oracle::Real(rho), depth + 1)) / (1 - oracle::Real(rho)));
      for (int pixel = 0; pixel < 4; ++pixel) {
        const double off = std::max(std::abs(rendered.image.rgb[3 * pixel] - expected),
                                    std::abs(rendered.image.rgb[3 * pixel + 1] - expected / 2));
        row.expect(off <= 1e-7 * expected + 1e-11 * depth, "rho " + std::to_string(rho));
      }
      if (std::pow(rho, depth + 1) > 0) {
        const RenderStatistics found = scenes::approximated(corridor(rho, depth), {}).statistics;  // without looks
        ASSERT_TRUE(found.rays.reflection == 4ull * depth && found.truncated_branches == 4u) << rho << " " << depth;
      }
    }
}

TEST(ClosedBoxOfEmissiveMirrors, HoldsEOverOneMinusRhoEverywhere) {
  Row row(25, "closed box of glowing mirrors: B = E / (1 - rho)", Oracle::closed_form, "pixels");
  for (const double rho : {0.0, 0.3, 0.9, 0.99}) {
    Scene scene = scenes::empty(32, {{0.3, 0.4, 0.9}, {1, 0.1, 0.2}, {0, 1, 0}, 120});
    Material wall = scenes::mirror(rho);
    wall.emission = Color{1, 0.5, 0.25};
    scenes::add(scene, Box{{0, 0, 0}, {1, 0.75, 1.5}}, wall);
    scenes::add(scene, Sphere{{0.7, 0.3, 0.4}, 0.2}, wall);
    scene.accuracy.max_depth = 5000;
    const Image image = stability::render(scene).image;
    const oracle::Real expected = 1 / (1 - oracle::Real(rho));
    for (std::size_t i = 0; i < image.rgb.size(); i += 3)
      row.expect(std::fabs(image.rgb[i] - expected) <= 1e-6L * expected &&
                 std::fabs(image.rgb[i + 2] - expected / 4) <= 1e-6L * expected);
  }
}

TEST(MirrorCorridor, TakesNoMemoryForDepth) {
  Row row(21, "mirror corridor of depth 1e6 in 1 MiB", Oracle::conservation, "bounces");
  Scene scene = corridor(0.999999, 1000);
  scene.image = {1, 1};
  stability::render(scene);
  const MemoryGrowth growth;
#ifdef WHITTLE_SANITIZED
  const long bound_kib = 512 << 10;  // sanitizers do not reuse freed memory
  scene.accuracy.max_depth = 20'000;
#else
  const long bound_kib = 1 << 10;
  scene.accuracy.max_depth = 1'000'000;
#endif
  const Rendered rendered = stability::render(scene);
  const oracle::Real rho = 0.999999;
  const oracle::Real expected = (1 - std::pow(rho, *scene.accuracy.max_depth + 1.0L)) / (1 - rho);
  EXPECT_LT(growth.kibibytes(), bound_kib);
  EXPECT_EQ(rendered.statistics.rays.reflection, *scene.accuracy.max_depth);
  const bool right = std::abs(rendered.image.rgb[0] - expected) <= 1e-6L * expected;
  row.count(rendered.statistics.rays.reflection, right ? 0 : rendered.statistics.rays.reflection, "its radiance");
}

// ---- extreme values ------------------------------------------------------------------------------------------------

/// Number of pixels whose values are finite and not negative.
void expect_finite(Row& row, const Rendered& rendered) {
  EXPECT_EQ(rendered.statistics.non_finite, 0u);
  for (std::size_t i = 0; i < rendered.image.rgb.size(); i += 3) {
    bool right = true;
    for (std::size_t c = i; c < i + 3; ++c) right &= std::isfinite(rendered.image.rgb[c]) && rendered.image.rgb[c] >= 0;
    row.expect(right);
  }
}

TEST(Extremes, OfDistanceGiveFiniteImages) {
  Row row(0, "cameras, lamps and balls up to 1e60 apart: finite", Oracle::conservation, "pixels");
  for (double distance = 1e3; distance < 1e60; distance *= 1e4)
    for (const double size : {1.0, 1e-55}) {
      SCOPED_TRACE(distance);
      Scene scene = scenes::empty(3, {{0, 0, distance}, {0, 0, 0}, {0, 1, 0}, 10});
      scene.ambient = {1, 1, 1};
      scene.lights = {scenes::directional_light({0, -1, -1}), scenes::point_light({0, 1e60, 0}),
                      scenes::point_light({0, 0, 0})};
      scene.lights[2].attenuation.kind = Attenuation::Kind::inverse_square;
      scene.accuracy.max_depth = 4;
      Material glossy = scenes::glass();
      glossy.diffuse = 1;
      glossy.specular = 1;
      scenes::add(scene, Sphere{{0, 0, 0}, size}, glossy);
      scenes::add(scene, scenes::placed(scenes::icosphere(0), size, {size, 0, 0}), MaterialId{0});
      expect_finite(row, stability::render(scene));
      scenes::add(scene, Plane{{0, -distance / 2, 0}, {0, 1, 0}, {}}, scenes::mirror(0.5));
      scenes::add(scene, Plane{{0, distance, 0}, {0, 1, 1e-9}, {}}, MaterialId{0});
      expect_finite(row, stability::render(scene));
      scene.objects.erase(scene.objects.begin(), scene.objects.begin() + 2);  // nothing finite: the world is the frame
      expect_finite(row, stability::render(scene));
    }
}

TEST(Extremes, OfPositionGiveFiniteImagesForCameraAndLightAtASurface) {
  Row row(16, "camera and lamp on, in, 1 ulp off surfaces: finite", Oracle::conservation, "pixels");
  for (const double at : {1.0, std::nextafter(1.0, 0), std::nextafter(1.0, 2), 0.0, 0.5})
    for (const double lamp : {1.0, std::nextafter(1.0, 0), std::nextafter(1.0, 2), 0.0, -1.0}) {
      Scene scene = scenes::empty(16, {{0, at, 0}, {1, at - 0.1, 0.3}, {0, 1, 0}, 120});
      scene.ambient = {0.1, 0.1, 0.1};
      scene.lights = {scenes::point_light({0, lamp, 0})};
      scene.accuracy.max_depth = 5;
      Material glossy = scenes::glass();
      glossy.diffuse = glossy.specular = 1;
      glossy.model = Material::Model::blinn_phong;
      scenes::add(scene, Sphere{{0, 0, 0}, 1}, glossy);
      scenes::add(scene, Plane{{0, 1, 0}, {0, 1, 0}, {}}, scenes::mirror(0.5));
      scenes::add(scene, Triangle{{{{-3, 0, -3}, {3, 0, -3}, {0, 0, 3}}}, {}, {}}, glossy);
      expect_finite(row, stability::render(scene));
    }
}

TEST(Extremes, OfRadianceAreClampedToTheLargestFloat) {
  Scene scene = scenes::empty(4, {{0, 0, 3}, {0, 0, 0}, {0, 1, 0}, 5});
  scene.lights = {scenes::point_light({0, 0, 3}, {1e30, 1e30, 1e30})};
  scene.lights[0].intensity = 1e30;
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, scenes::matte({1, 1, 1}));
  const Rendered rendered = stability::render(scene);
  EXPECT_EQ(rendered.statistics.non_finite, 0u) << "1e60 is a number";
  for (const float value : rendered.image.rgb) EXPECT_EQ(value, std::numeric_limits<float>::max());
}

TEST(NonFiniteSamples, AreCountedAndLeftOutOfTheMeanOfTheirPixel) {
  // Mirrors with a reflectance of 1e30: infinite after eleven bounces. An emissive sheet hides the left half of the
  // image and of the middle pixel.
  Scene scene = corridor(1, 20);
  scene.image = {7, 1};
  scene.camera.fov_deg = 1e-3;
  scene.accuracy.samples = 64;
  scene.materials[0].reflection_color = Color{1e30, 1e30, 1e30};
  scenes::add(scene, Triangle{{{{0, -1, 0.5}, {0, 1, 0.5}, {2, 0, 0.5}}}, {}, {}}, scenes::glowing({3, 3, 3}));
  const Rendered rendered = scenes::render(scene);  // not the table's: here they are wanted
  Row row(0, "samples made infinite on purpose are left out, and counted", Oracle::closed_form, "pixels");
  for (int x = 0; x < 7; ++x)
    for (int c = 0; c < 3; ++c) row.expect(rendered.image.rgb[3 * x + c] == (x <= 3 ? 3 : 0));
  EXPECT_EQ(rendered.statistics.samples, 7u * 64);
  EXPECT_GT(rendered.statistics.non_finite, 3u * 64) << "those of three pixels, and some of the middle one";
  EXPECT_LT(rendered.statistics.non_finite, 4u * 64);
}

TEST(HugeSphere, EqualsTheReferenceTracerInFloat) {
  Row row(7, "spheres of R = 1e3 .. 1e9 beside the second tracer", Oracle::closed_form, "pixels");
  row.bound("the path passes an edge by less than 1e-9", 1e-3);
  for (const double radius : {1e3, 1e6, 1e9}) {
    Scene scene = scenes::empty(64, {{0, 1, 0}, {1, 0.5, 0}, {0, 1, 0}, 60});
    scene.lights = {scenes::point_light({2, 3, 1})};
    scenes::add(scene, Sphere{{0, -radius, 0}, radius}, scenes::matte({1, 1, 1}));
    compare_with_reference(row, scene, {.absolute = 1e-7L, .relative = 0x1p-24L, .edge = 1e-9L},
                           "radius " + std::to_string(radius));
  }
}

/// A glossy sphere in front of the camera, with the light at the camera or next to it.
Scene shining(Material::Model model, double shininess, const Vec3& lamp) {
  Scene scene = scenes::empty(33, {{0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 30});
  scene.lights = {scenes::point_light(lamp)};
  Material material = scenes::matte({0.5, 0.4, 0.3});
  material.model = model;
  material.specular = 0.8;
  material.shininess = shininess;
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, material);
  return scene;
}

TEST(HighlightExponents, FromZeroToTheLargestDoubleGiveThePower) {
  Row row(13, "exponents 0, 1, 1e3, 1e6, 1e12, 1e308, both lobes", Oracle::closed_form, "pixels");
  row.bound("the path passes the ball's silhouette or the light's edge by less than 1e-9", 1e-3);
  for (const auto model : {Material::Model::phong, Material::Model::blinn_phong})
    for (const double shininess : {0.0, 5e-324, 1.0, 1e3, 1e6, 1e12, 1e308})
      for (const Vec3& lamp : {Vec3{0, 0, 4}, Vec3{3, 2, 4}, Vec3{-0.01, 0.02, 3}})
        // A cosine of 1 - c that is off by a few roundings is off n times as much in the power, but where that has any
        // value c is below 40 / n.
        compare_with_reference(row, shining(model, shininess, lamp),
                               {.absolute = 1e-6L, .relative = 1e-6L, .edge = 1e-9L}, "n " + std::to_string(shininess));
}

/// An emissive shape in front of black, with parallel rays: 32 x 32 pixels of 1 x 1.
Scene window(Shape shape, std::uint32_t samples) {
  Scene scene = scenes::empty(32, {{0, 0, 50}, {0, 0, 0}, {0, 1, 0}, 45});
  scene.camera.type = Camera::Type::orthographic;
  scene.camera.height = 32;
  scene.accuracy.samples = samples;
  scenes::add(scene, std::move(shape), scenes::glowing({1, 1, 1}));
  return scene;
}

/// A rectangle of `width` x 20, rotated by `turn` about its center, which is not the corner of a pixel.
Shape slat(int kind, double width, double turn) {
  const double c = std::cos(turn), s = std::sin(turn), h = width / 2;
  const auto at = [&](double u, double v) { return Vec3{0.13 + u * c - v * s, 0.29 + u * s + v * c, 0}; };
  if (kind == 0) return Cylinder{at(0, -10), at(0, 10), h, true, {}};
  if (kind == 1) return scenes::quad(at(-h, -10), at(h, -10), at(h, 10), at(-h, 10));
  return Triangle{{{at(-h, -10), at(h, -10), at(0, 10)}}, {}, {}};
}

TEST(SlatsThinnerThanAPixel, CoverTheirArea) {
  Row row(27, "1 to 1/1000 px wide: light is the area, to 5 sigma of the samples", Oracle::closed_form, "images");
  const auto samples = static_cast<std::uint32_t>(effort::cases(256));
  double largest = 0;
  for (const int kind : {0, 1, 2})
    for (const double width : {1.0, 0.3, 0.01, 0.001})
      for (const double turn : {0.0, 0.4, std::numbers::pi / 4}) {
        const Image image = stability::render(window(slat(kind, width, turn), samples), 2).image;
        double light = 0;
        for (std::size_t i = 0; i < image.rgb.size(); i += 3) light += image.rgb[i];
        const double area = kind == 2 ? width * 10 : width * 20;
        // Independent samples would leave the variance of a binomial; stratified ones leave less.
        const double sigma = std::sqrt(area / samples);
        largest = std::max(largest, std::fabs(light - area) / sigma);
        row.expect(std::fabs(light - area) <= 5 * sigma, "width " + std::to_string(width));
      }
  row.note("largest " + std::to_string(largest).substr(0, 4) + " sigma");
}

}  // namespace
