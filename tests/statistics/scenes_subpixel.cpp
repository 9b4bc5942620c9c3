// Features much thinner than a pixel, which few samples hit.
#include <cmath>
#include <numbers>

#include "tests/statistics/scene_corpus.h"

namespace statistics {
namespace {

using namespace tracer;

/// World length of a pixel's height at `distance` from the camera.
double pixel_at(const Scene& scene, double distance) {
  return 2 * std::tan(scene.camera.fov_deg * std::numbers::pi / 360) * distance / scene.image.height;
}

/// An empty scene in front of a constant background, viewed along -z from a distance of 6.
Case sparse(std::string name, std::string exercises) {
  Case c = empty_case(std::move(name), std::move(exercises));
  c.scene.camera.position = {0, 0, 6};
  c.scene.camera.look_at = {0, 0, 0};
  return c;
}

Case wire(std::string name, std::string exercises, const Vec3& from, const Vec3& to) {
  Case c = sparse(std::move(name), std::move(exercises));
  const double radius = 0.01 * pixel_at(c.scene, 6);
  scenes::add(c.scene, Cylinder{from, to, radius, false, {}}, scenes::glowing({1, 1, 1}));
  return c;
}

Case bright_pixel() {
  Case c = sparse("bright_pixel", "a ball about as large as a pixel, across four of them");
  scenes::add(c.scene, Sphere{{0.013, 0.017, 0}, 0.5 * pixel_at(c.scene, 6)}, scenes::glowing({1, 0.9, 0.5}));
  return c;
}

Case far_star(std::string name, std::string exercises, double brightness) {
  Case c = sparse(std::move(name), std::move(exercises));
  // pi r^2 = a thousandth of the pixel.
  const double pixel = pixel_at(c.scene, 6), radius = pixel * std::sqrt(0.001 / std::numbers::pi);
  scenes::add(c.scene, Sphere{{3.4 * pixel, 2.3 * pixel, 0}, radius},
              scenes::glowing({brightness, brightness, brightness}));
  return c;
}

Case wires_on_floor() {
  Case c = lit_floor_case("wires_on_floor", "a fan of wires of 0.02 to 0.5 pixels, and their shadows");
  for (int i = 0; i < 8; ++i) {
    const double a = std::numbers::pi * (i + 0.5) / 8, radius = pixel_at(c.scene, 6) * 0.01 * std::pow(25.0, i / 7.0);
    scenes::add(c.scene, Cylinder{{0, 0.3, 0}, {2 * std::cos(a), 0.3 + 1.2 * std::sin(a), 0}, radius, true, {}},
                scenes::matte({0.9, 0.6, 0.2}));
  }
  return c;
}

Case slit() {
  Case c = lit_floor_case("slit", "sun through a slit much narrower than a pixel");
  c.scene.lights = {scenes::directional_light({0, -1, -0.2})};
  scenes::add(c.scene, Box{{-5, 2.5, -5}, {-0.1, 2.6, 5}}, scenes::matte({0.5, 0.5, 0.5}));
  scenes::add(c.scene, Box{{-0.1 + 0.1 * pixel_at(c.scene, 6), 2.5, -5}, {5, 2.6, 5}}, scenes::matte({0.5, 0.5, 0.5}));
  return c;
}

Case dust() {
  Case c = sparse("dust", "two hundred glowing grains of a hundredth of a pixel each");
  const double pixel = pixel_at(c.scene, 6), radius = pixel * std::sqrt(0.01 / std::numbers::pi);
  const MaterialId glow = scenes::add(c.scene, scenes::glowing({3, 3, 3}));
  for (int i = 0; i < 200; ++i) {
    // R2 sequence (Roberts 2018): low discrepancy, from the plastic number.
    const double x = std::fmod(0.7548776662466927 * (i + 1), 1.0), y = std::fmod(0.5698402909980532 * (i + 1), 1.0);
    scenes::add(c.scene, Sphere{{(x - 0.5) * 46 * pixel, (y - 0.5) * 34 * pixel, 0}, radius}, glow);
  }
  return c;
}

}  // namespace

std::vector<Case> subpixel_cases() {
  return {wire("wire", "an upright wire of 0.02 pixels", {0.05, -1.5, 0}, {0.05, 1.5, 0}),
          wire("diagonal_wire", "a wire of 0.02 pixels across rows and columns", {-2, -1.4, 0}, {2.1, 1.5, 0}),
          bright_pixel(),
          far_star("far_star", "a white ball of a thousandth of a pixel", 1),
          far_star("bright_star", "a ball of a thousandth of a pixel that makes its pixel white", 1000),
          wires_on_floor(),
          slit(),
          dust()};
}

}  // namespace statistics
