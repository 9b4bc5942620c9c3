// Cameras and lights on, in and behind surfaces, to the last bit.
#include <gtest/gtest.h>

#include "tests/stability/table.h"
#include "tests/support/random.h"

namespace {

using oracle::Real;
using oracle::Vec;
using namespace tracer;
using stability::Oracle;
using stability::Row;

TEST(Shadow, IsNotCastByTheSurfaceOfTheLight) {
  Row row(17, "lamps on a ball and a ceiling cast no shadow of them", Oracle::invariance, "pixels");
  // A tilted ceiling and a ball, each with lamps on it, to the last bit or one beside.
  oracle::Random random(1);
  const Vec normal = unit(Vec(0.1L, -1, 0.2L)), across = unit(cross(normal, Vec(0, 0, 1)));
  for (int i = 0; i < 40; ++i) {
    Scene open = scenes::empty(16, {{0, 2, 6}, {0, 0, 0}, {0, 1, 0}, 20});
    scenes::add(open, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
    Scene closed = open;
    const bool ball = i % 2 == 0;
    const Vec lamp =
        ball ? Vec(0, 5, 0) - unit(Vec(random.in(-0.2, 0.2), 3, random.in(-0.2, 0.2)))
             : Vec(0, 4, 0) + Real(random.in(-1, 1)) * across + Real(random.in(-1, 1)) * cross(normal, across);
    open.lights = closed.lights = {scenes::point_light(rounded(lamp))};
    scenes::add(closed, ball ? Shape{Sphere{{0, 5, 0}, 1}} : Plane{{0, 4, 0}, rounded(normal), {}}, MaterialId{0});
    const auto expected = stability::render(open).image.rgb, image = stability::render(closed).image.rgb;
    for (std::size_t p = 0; p < image.size(); p += 3)
      row.expect(std::fabs(image[p] - expected[p]) <= 3e-7F * expected[p], ball ? "ball" : "ceiling");
  }
}

TEST(Shadow, OfASphereEnclosesALightInside) {
  Row row(17, "a lamp in a ball lights all of its inside and nothing else", Oracle::closed_form, "pixels");
  Scene scene = scenes::empty(32, {{0, 3, 6}, {0, 0, 0}, {0, 1, 0}, 20});
  scene.lights = {scenes::point_light({0, 0.5, 0})};
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, scenes::matte({1, 1, 1}));
  scenes::add(scene, Plane{{0, -1, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
  const auto without = stability::render(scene).image.rgb;
  for (std::size_t i = 0; i < without.size(); i += 3) row.expect(without[i] == 0, "light gets out");
  scene.camera = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 150};
  const auto within = stability::render(scene).image.rgb;
  for (std::size_t i = 0; i < within.size(); i += 3) row.expect(within[i] > 0, "dark inside");
}

/// A body, and the height at which the y axis leaves it.
struct Body {
  Shape shape;
  double top = 1;
};

std::vector<Body> bodies() {
  return {{Sphere{{0, 0, 0}, 1}, 1},
          {Box{{-1, -1, -1}, {1, 1, 1}}, 1},
          {Cylinder{{0, -1, 0}, {0, 1, 0}, 1, true, {}}, 1},
          {Cylinder{{-1, 0, 0}, {1, 0, 0}, 1, true, {}}, 1},
          {Cone{{0, 1, 0}, {0, -1, 0}, 1, 0.5, true, {}}, 1},
          {scenes::icosphere(1), 0.5}};
}

TEST(Camera, OnASurfaceSeesTheSolidInwardsOnly) {
  Row row(16, "camera on, in, 1 ulp off a glowing body looks in: all glows", Oracle::closed_form, "pixels");
  for (const Body& body : bodies()) {
    const double at = body.top;
    for (const double y : {at, std::nextafter(at, -1), std::nextafter(at, 2), at - 1e-300, at - 1e-9, at - 0.5})
      for (const double size : {1e-9, 1.0, 1e9}) {
        Scene scene = scenes::empty(24, {{0, y * size, 0}, {0.1 * size, (y - 1) * size, 0.2 * size}, {1, 0, 0}, 60});
        scenes::add(scene, body.shape, scenes::glowing({1, 1, 1}));
        scene.objects[0].transform = Transform{{{{size, 0, 0, 0}, {0, size, 0, 0}, {0, 0, size, 0}}}};
        const Image image = stability::render(scene).image;
        for (std::size_t i = 0; i < image.rgb.size(); i += 3)
          row.expect(image.rgb[i] == 1, "shape " + std::to_string(body.shape.index()) + " y " + std::to_string(y - at));
      }
  }
}

TEST(Light, BehindASurfaceLeavesItDarkAndTheImageFinite) {
  Row dark(17, "a lamp behind an opaque wall: dark", Oracle::closed_form, "pixels");
  Row finite(17, "lamps of every kind on, in, behind surfaces: finite", Oracle::conservation, "pixels");
  for (const double y : {-1e-300, -5e-324, -0x1p-53, -1.0, 0.0, 0x1p-53, 1.0}) {
    const std::vector<LightSource> sources{PointLight{{0, y, 0}},
                                           SpotLight{{0, y, 0}, {0, 1, 0}, 80, 85},
                                           LineLight{{-1, y, 0}, {1, y, 0}},
                                           RectLight{{-1, y, -1}, {2, 0, 0}, {0, 0, 2}},
                                           DiscLight{{0, y, 0}, {0, 1, 0}, 1},
                                           SphereLight{{0, y - 1e-3, 0}, 1e-3}};
    for (const LightSource& source : sources)
      for (const auto kind : {Attenuation::Kind::none, Attenuation::Kind::inverse_square}) {
        Scene scene = scenes::empty(16, {{0, 2, 0.5}, {0, 0, 0}, {0, 0, -1}, 60});
        scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
        scenes::add(scene, Sphere{{0, 0, 0}, 0.25}, scenes::glass());
        scene.materials[1].specular = scene.materials[1].diffuse = 1;
        scene.lights.push_back({source, {1, 1, 1}, 1, true, {kind, {1, 0, 0}}});
        for (const bool ball : {true, false}) {
          if (!ball) scene.objects.pop_back();
          const Image image = stability::render(scene).image;
          for (std::size_t i = 0; i < image.rgb.size(); i += 3) {
            finite.expect(std::isfinite(image.rgb[i]) && image.rgb[i] >= 0);
            if (!ball && y < 0) dark.expect(image.rgb[i] == 0);
          }
        }
      }
  }
}

}  // namespace
