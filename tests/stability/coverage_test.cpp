// Slats thinner than a pixel.
#include <gtest/gtest.h>

#include <numbers>

#include "tests/stability/table.h"
#include "tests/support/effort.h"

namespace {

using namespace tracer;
using stability::Oracle;
using stability::Row;

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
