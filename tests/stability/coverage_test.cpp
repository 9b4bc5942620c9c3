// Shapes much smaller than a pixel: a sphere a million radii away, and slats thinner than a pixel.
#include <gtest/gtest.h>

#include <numbers>

#include "tests/stability/table.h"
#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/unit/shapes/look.h"

namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;
using namespace tracer;
using stability::Oracle;
using stability::Row;

TEST(DistantSphere, IsHitByRaysThatPassItsCenterWithinItsRadius) {
  Row row(8, "sphere at D/R = 1e6: each ray, and the part of a cone that hits", Oracle::closed_form, "rays");
  row.bound("the ray passes the silhouette by less than 1e-9 R", 1e-6);
  Random random(1);
  for (const double radius : {1e-9, 1.0, 1e9}) {
    Scene scene = scenes::empty(1);
    scenes::add(scene, Sphere{{0, 0, 0}, radius}, scenes::matte({1, 1, 1}));
    const auto made = compiled(scene);
    const Vec center = made->frame.render_from_world(Vec3{0, 0, 0});
    const Real r = made->frame.render_from_world(radius), distance = 1e6L * r;
    std::uint64_t hits = 0;
    const std::uint64_t rays = effort::cases(150'000);
    // Uniform in the cone of half-angle b around the centre: 1 - cos is uniform. 2 sin^2(x/2) keeps its digits.
    const Real b = 1.5e-6L;
    const auto one_minus_cos = [](Real x) { return 2 * std::sin(x / 2) * std::sin(x / 2); };
    for (std::uint64_t i = 0; i < rays; ++i) {
      const Vec axis = random.direction();
      const Real u = random.in(0, 1) * one_minus_cos(b), sine = std::sqrt(u * (2 - u));
      const Vec3 o = rounded(center - distance * axis), d = rounded(unit((1 - u) * axis + sine * random.across(axis)));
      const Vec along = unit(Vec(d)), to = center - Vec(o);
      const Real miss = length(cross(along, to));
      const bool hit = look(*made, o, d).found;
      hits += hit ? 1 : 0;
      const bool certain = std::fabs(miss - r) > 1e-9L * r;
      if (!certain) row.undecided();
      row.expect(!certain || hit == (miss < r));
    }
    const Real expected = one_minus_cos(std::asin(1e-6L)) / one_minus_cos(b);
    const Real sigma = std::sqrt(static_cast<Real>(rays) * expected * (1 - expected));
    EXPECT_LE(std::fabs(static_cast<Real>(hits) - static_cast<Real>(rays) * expected), 5 * sigma)
        << hits << " of " << rays << " rays: the solid angles are as 1 to " << static_cast<double>(1 / expected);
  }
}

/// An emissive shape in front of black, with parallel rays: 32 x 32 pixels of 1 x 1.
Scene window(Shape shape, std::uint32_t samples) {
  Scene scene = scenes::empty(32);
  scene.camera = {{0, 0, 50}, {0, 0, 0}, {0, 1, 0}, 45};
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
  if (kind == 1) return Mesh{{at(-h, -10), at(h, -10), at(h, 10), at(-h, 10)}, {{0, 1, 2}, {0, 2, 3}}, {}, {}, false};
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
