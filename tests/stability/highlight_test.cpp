// Exponents of 0, a million and 1e308.
#include <gtest/gtest.h>

#include "tests/stability/table.h"
#include "tests/support/reference_tracer.h"

namespace {

using oracle::Real;
using namespace tracer;
using stability::Oracle;
using stability::Row;

/// A glossy sphere in front of the camera, with the light at the camera or next to it.
Scene shining(Material::Model model, double shininess, const Vec3& lamp) {
  Scene scene = scenes::empty(33);
  scene.camera = {{0, 0, 4}, {0, 0, 0}, {0, 1, 0}, 30};
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
      for (const Vec3& lamp : {Vec3{0, 0, 4}, Vec3{3, 2, 4}, Vec3{-0.01, 0.02, 3}}) {
        const Scene scene = shining(model, shininess, lamp);
        const Image image = stability::render(scene).image;
        RenderStatistics ignored;
        const auto expected = oracle::ReferenceTracer(scene).image(ignored);
        for (std::size_t i = 0; i < expected.size(); ++i) {
          const Real e = expected[i].radiance.r;
          // A cosine of 1 - c that is off by a few roundings is off n times as much in the power, but where that has
          // any value c is below 40 / n.
          const bool right = std::fabs(image.rgb[3 * i] - e) <= 1e-6L * (1 + e);
          if (!right && expected[i].margin < 1e-9L) row.undecided();
          row.expect(right || expected[i].margin < 1e-9L, "n " + std::to_string(shininess) + ": " +
                                                              std::to_string(image.rgb[3 * i]) + ", not " +
                                                              std::to_string(e));
        }
      }
}

}  // namespace
