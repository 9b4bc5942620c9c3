// Highlights of Phong and Blinn, against their definitions in long double.
#include <gtest/gtest.h>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tracer/src/integrators/whitted/direct_lighting.h"
#include "tracer/src/materials/compiled_material.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;
using enum Material::Model;

/// Specular factor at unit normal n for unit directions l to the light and v to the eye.
double specular_factor(Material::Model model, double shininess, const Vec3& n, const Vec3& l, const Vec3& v) {
  ShadingPointQueue shading_points;
  shading_points.push({.normal = n,
                       .to_eye = v,
                       .specular = model == lambert ? Color{} : Color{1, 1, 1},
                       .shininess = shininess,
                       .blinn = model == blinn_phong});
  LightSamplePacket sample;
  sample_light(shading_points.packet(0), {.kind = light_kind<DirectionalLight>, .axis = l, .radiance = {1, 1, 1}}, 1, 1,
               sample);
  return sample.lit == 0 ? 0 : sample.radiance.r[0];
}

TEST(SpecularFactor, MatchesTheDefinitionForRandomDirections) {
  Random random(2);
  for (std::uint64_t i = 0; i < effort::cases(100'000); ++i) {
    const Vec3 n = rounded(random.direction()), l = rounded(random.direction()), v = rounded(random.direction());
    const double shininess = random.chance(0.2) ? 0 : random.spread(0.1, 1e4);
    const Vec nn = n, ll = l, vv = v;
    const Real n_l = dot(nn, ll);
    if (std::fabs(n_l) < 1e-12L) continue;
    const Real r_v = std::fmax(0.0L, dot(2 * n_l * nn - ll, vv)), n_h = std::fmax(0.0L, dot(nn, unit(ll + vv)));
    const Real phong_expected = n_l <= 0 ? 0 : shininess == 0 ? 1 : std::pow(std::fmin(r_v, 1.0L), Real(shininess));
    const Real blinn_expected = n_l <= 0 ? 0 : shininess == 0 ? 1 : std::pow(std::fmin(n_h, 1.0L), Real(shininess));
    // The error of a cosine is 1e-16, that of its power n times that over the cosine.
    const auto tolerance = [&](Real cosine, Real value) {
      return static_cast<double>(1e-15L * (1 + shininess / std::fmax(cosine, 1e-3L)) * value + 1e-15L);
    };
    ASSERT_NEAR(specular_factor(phong, shininess, n, l, v), static_cast<double>(phong_expected),
                tolerance(r_v, phong_expected));
    ASSERT_NEAR(specular_factor(blinn_phong, shininess, n, l, v), static_cast<double>(blinn_expected),
                tolerance(n_h, blinn_expected));
    ASSERT_EQ(specular_factor(lambert, shininess, n, l, v), 0);
  }
}

TEST(SpecularFactor, HasTheComputedValues) {
  const Vec3 n{0, 0, 1};
  const double s = std::sqrt(0.5);
  const Vec3 l{s, 0, s};  // 45 degrees; its mirror image is {-s, 0, s}
  EXPECT_NEAR(specular_factor(phong, 10, n, l, {-s, 0, s}), 1, 1e-14);
  EXPECT_NEAR(specular_factor(phong, 10, n, l, {0, 0, 1}), std::pow(s, 10), 1e-15) << "45 degrees off: 2^-5";
  EXPECT_NEAR(specular_factor(blinn_phong, 10, n, l, {-s, 0, s}), 1, 1e-14);
  EXPECT_NEAR(specular_factor(blinn_phong, 10, n, l, {0, 0, 1}), std::pow(std::cos(std::atan(1) / 2), 10), 1e-15)
      << "halfway is 22.5 degrees off";
  EXPECT_EQ(specular_factor(phong, 10, n, l, l), specular_factor(phong, 10, n, {-s, 0, s}, {-s, 0, s}));
}

TEST(SpecularFactor, IsNothingWhereTheLightIsBehindTheSurfaceHoweverTheMirrorLooks) {
  const Vec3 n{0, 0, 1}, below{0.6, 0, -0.8}, along{1, 0, 0};
  for (const auto model : {phong, blinn_phong})
    for (const double shininess : {0.0, 0.5, 1.0, 1e6})
      for (const Vec3& v : {Vec3{0, 0, 1}, Vec3{-0.6, 0, -0.8}, Vec3{0.6, 0, 0.8}}) {
        EXPECT_EQ(specular_factor(model, shininess, n, below, v), 0);
        EXPECT_EQ(specular_factor(model, shininess, n, along, v), 0);
      }
}

TEST(SpecularFactor, IsNothingWhereTheLightIsOppositeTheEyeAndNoHalfwayDirectionExists) {
  // l = -v: there is no halfway direction.
  const Vec3 n{0, 0, 1}, l{0, 0, 1};
  EXPECT_EQ(specular_factor(blinn_phong, 32, n, l, -l), 0);
}

}  // namespace
}  // namespace tracer
