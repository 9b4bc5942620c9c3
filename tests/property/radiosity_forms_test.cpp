// Radiosity against closed forms of light that comes from everywhere.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/property/global_radiance.h"

namespace tracer {
namespace {

constexpr Approximations by_radiosity{.interreflection = Approximations::Interreflection::radiosity};

/// By more patches for a smaller target error.
Image image_of(Scene scene, double target) {
  scene.accuracy.target_error = target;
  return scenes::approximated(scene, by_radiosity).image;
}

void expect_truth(const Scene& scene, double truth, const std::string& name) {
  EXPECT_NEAR(mean_radiance(image_of(scene, 4)), truth, 0.01 * truth) << name;
}

/// 16 x 16 pixels, which a field of view of so many degrees fills with one surface.
Scene wide_view_of(const Vec3& target, const Vec3& position, double fov_deg) {
  Scene scene = view_of(target, position, 16);
  scene.image = {16, 16, {}};
  scene.camera.fov_deg = fov_deg;
  return scene;
}

Mesh huge_square(double z) {
  constexpr double half = 512;
  return scenes::quad({-half, -half, z}, {half, -half, z}, {half, half, z}, {-half, half, z});
}

TEST(Radiosity, BetweenPlanesIsThatOfTheSeries) {
  for (const bool infinite : {true, false}) {
    for (const bool first : {true, false}) {
      Scene scene = wide_view_of({0.1, 0, first ? 0.0 : 1.0}, {0, 0, 0.5}, 90);
      if (infinite) {
        scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(0.5, 1));
        scenes::add(scene, Plane{{0, 0, 1}, {0, 0, 1}, {}}, surface(0.8));
        // Planes are divided around finite objects.
        for (const double x : {-3.0, 3.0}) scenes::add(scene, Sphere{{x, 3, 0.5}, 0.01}, surface(0));
      } else {
        scenes::add(scene, huge_square(0), surface(0.5, 1));
        scenes::add(scene, huge_square(1), surface(0.8));
      }
      expect_truth(scene, first ? 1 / 0.6 : 0.8 / 0.6,
                   std::string(infinite ? "infinite" : "huge") + (first ? ", glowing" : ", not glowing"));
    }
  }
}

TEST(Radiosity, UnderAUniformSkyIsThePartInSight) {
  constexpr double rho = 0.7, sky = 3;
  for (const bool wall : {false, true}) {
    Scene scene = wide_view_of({0.5, 0, 0}, {3, -3, 3}, 5);
    scene.background.color = {sky, sky, sky};
    scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(rho));
    if (wall) scenes::add(scene, Plane{{0, 0, 0}, {1, 0, 0}, {}}, surface(0));
    for (const double y : {-1.0, 1.0}) scenes::add(scene, Sphere{{0.5, y, 0.01}, 0.01}, surface(0));
    expect_truth(scene, rho * sky / (wall ? 2 : 1), wall ? "beside a black wall" : "open");
  }
}

/// Form factor from a place (x, y, 0) to the rectangle [-half, half] x [0, height] of the plane x = 0.
double form_factor(double x, double y, double half, double height) {
  constexpr int parts = 256;
  double sum = 0;  // over strips of the rectangle along z
  for (int i = 0; i < parts; ++i) {
    const double aside = y - half * (2 * (i + 0.5) / parts - 1), near = x * x + aside * aside;
    // The integral of x z / (pi (near + z^2)^2) over z.
    sum += x / (2 * pi) * (1 / near - 1 / (near + height * height));
  }
  return sum * 2 * half / parts;
}

TEST(Radiosity, BesideAWallIsTheClosedForm) {
  constexpr double half = 1, height = 0.5;
  Scene scene = view_of({0.5, 0, 0}, {0.5, 0, 8}, 16);
  constexpr std::uint32_t side = 32;
  scene.image = {side, side, {}};
  scene.camera.fov_deg = 2 * std::atan(half / 2 / 8) * 180 / pi;
  scene.camera.up = {0, 1, 0};
  scene.background.color = {1, 1, 1};
  scenes::add(scene, scenes::quad({0, -half, 0}, {2 * half, -half, 0}, {2 * half, half, 0}, {0, half, 0}), surface(1));
  scenes::add(scene, scenes::quad({0, -half, 0}, {0, half, 0}, {0, half, height}, {0, -half, height}), surface(0));
  const auto error = [&](double target) {
    const Image image = image_of(scene, target);
    double squares = 0;
    for (std::uint32_t row = 0; row < side; ++row) {
      for (std::uint32_t column = 0; column < side; ++column) {
        const double x = (column + 0.5) / side * half, y = half * (0.5 - (row + 0.5) / side);
        const double truth = 1 - form_factor(x, y, half, height);
        squares += std::pow(image.rgb[3 * (std::size_t{row} * side + column)] - truth, 2);
      }
    }
    return std::sqrt(squares) / side;
  };
  for (const double target : {16.0, 0.5}) EXPECT_LT(error(target), 0.01);
}

}  // namespace
}  // namespace tracer
