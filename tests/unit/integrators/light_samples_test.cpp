// Direct lighting of one light at packets of shading points, against its formulas in long double.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <tuple>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tracer/src/integrators/whitted/direct_lighting.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;

ShadingPoint random_shading_point(Random& random) {
  const Vec3 position{random.in(-1, 1), random.in(-1, 1), random.in(-1, 1)};
  const double error = random.spread(1e-17, 1e-12);
  return {.point = {position, {error, 2 * error, 3 * error}},
          .face = rounded(random.direction()),
          .normal = rounded(random.direction()),
          .to_eye = rounded(random.direction()),
          .diffuse = {random.in(0, 1), random.in(0, 1), 0},
          .specular = random.chance(0.5) ? Color{} : Color{0, random.in(0, 1), random.in(0, 1)},
          .shininess = random.chance(0.2) ? 0 : random.spread(0.1, 1e4),
          .blinn = random.chance(0.5)};
}

CompiledLight random_light(Random& random) {
  const std::uint8_t kinds[] = {light_kind<PointLight>, light_kind<SpotLight>, light_kind<DirectionalLight>};
  const Attenuation::Kind fades[] = {Attenuation::Kind::none, Attenuation::Kind::polynomial,
                                     Attenuation::Kind::inverse_square};
  return {.kind = kinds[random.below(3)],
          .position = {random.in(-3, 3), random.in(-3, 3), random.in(-3, 3)},
          .axis = rounded(random.direction()),
          .cos_inner = 0.4,
          .cos_outer = -0.3,
          .radiance = {random.in(0, 2), random.in(0, 2), random.in(0, 2)},
          .attenuation = {fades[random.below(3)], {0.2, 0.3, 0.1}}};
}

Real strength(const CompiledLight& light, Real distance, const Vec& to_light) {
  if (light.kind == light_kind<DirectionalLight>) return 1;
  Real f = 1;
  const auto& c = light.attenuation.coefficients;
  if (light.attenuation.kind == Attenuation::Kind::polynomial)
    f = std::fmin(1 / (c[0] + c[1] * distance + c[2] * distance * distance), 1.0L);
  if (light.attenuation.kind == Attenuation::Kind::inverse_square) f = 1 / (distance * distance);
  if (light.kind != light_kind<SpotLight>) return f;
  const Real x = (dot(-to_light, Vec(light.axis)) - light.cos_outer) / (Real(light.cos_inner) - light.cos_outer);
  return f * (x <= 0 ? 0 : x >= 1 ? 1 : x * x * (3 - 2 * x));
}

Real highlight_of(const ShadingPoint& shading_point, const Vec& to_light) {
  const Vec n = shading_point.normal, v = shading_point.to_eye;
  const Real cosine = shading_point.blinn ? dot(n, unit(to_light + v)) : dot(2 * dot(n, to_light) * n - to_light, v);
  return std::pow(std::clamp(cosine, 0.0L, 1.0L), Real(shading_point.shininess));
}

/// The light at the points, of a light with its own strength.
LightSamplePacket sampled(const ShadingPointPacket& points, const CompiledLight& light) {
  LightSamplePacket sample;
  for (int i = 0; i < lanes; ++i) sample.from.set(i, light.position);
  sample_light(points, light, 1, 1, {}, sample);
  return sample;
}

TEST(LightSamplePacket, MatchesTheLocalModelForEveryKindOfLight) {
  Random random(11);
  std::uint64_t lit = 0;
  for (std::uint64_t round = 0; round < effort::cases(3'000); ++round) {
    ShadingPointQueue shading_points;
    std::vector<ShadingPoint> all;
    for (int i = 0; i < 2 * lanes - 3; ++i) shading_points.push(all.emplace_back(random_shading_point(random)));
    const CompiledLight light = random_light(random);
    const double world_per_render = random.chance(0.5) ? 1 : 4, share = random.in(0.1, 1);
    for (std::size_t packet = 0; packet < shading_points.packets(); ++packet) {
      LightSamplePacket sample;
      for (int i = 0; i < lanes; ++i) sample.from.set(i, light.position);
      sample_light(shading_points.packet(packet), light, world_per_render, share, {}, sample);
      for (int lane = 0; lane < shading_points.packet(packet).count; ++lane) {
        const ShadingPoint& shading_point = all[packet * lanes + static_cast<std::size_t>(lane)];
        const Vec offset = Vec(light.position) - Vec(shading_point.point.position);
        const Vec to_light = light.kind == light_kind<DirectionalLight> ? Vec(light.axis) : unit(offset);
        const Real cosine = dot(Vec(shading_point.normal), to_light);
        if (std::fabs(cosine) < 1e-12L) continue;
        const Real power = share * strength(light, length(offset) * world_per_render, to_light);
        const bool lit_lane = (sample.lit >> lane & 1) != 0;
        ASSERT_EQ(lit_lane, cosine > 0 && power > 0) << round << " lane " << lane;
        if (!lit_lane) continue;
        ++lit;
        const Real spec = highlight_of(shading_point, to_light);
        const bool is_spot = light.kind == light_kind<SpotLight>;
        const auto inside = static_cast<double>(is_spot ? dot(-to_light, Vec(light.axis)) - light.cos_outer : 1);
        const auto expect = [&](double got, double diffuse, double specular, double radiance) {
          const auto expected = static_cast<double>((diffuse * cosine + specular * spec) * power * radiance);
          // The error of a cosine is 1e-15, that of its power as many times that as the exponent, and that of a spot's
          // edge, which is a square, twice that over the distance from the edge.
          const double tolerance = 1e-12 + 4e-15 * shading_point.shininess + 2e-15 / inside;
          EXPECT_NEAR(got, expected, tolerance * (expected + static_cast<double>(power))) << round << " lane " << lane;
        };
        expect(sample.radiance.r[lane], shading_point.diffuse.r, shading_point.specular.r, light.radiance.r);
        expect(sample.radiance.g[lane], shading_point.diffuse.g, shading_point.specular.g, light.radiance.g);
        expect(sample.radiance.b[lane], shading_point.diffuse.b, shading_point.specular.b, light.radiance.b);
      }
    }
  }
  EXPECT_GT(lit, effort::cases(3'000)) << "some lanes must be lit";
}

TEST(LightSamplePacket, OffsetsTheOriginsOfShadowRays) {
  Random random(12);
  for (std::uint64_t round = 0; round < effort::cases(1'000); ++round) {
    ShadingPointQueue shading_points;
    ShadingPoint shading_point = random_shading_point(random);
    const CompiledLight light{
        .kind = light_kind<DirectionalLight>, .axis = rounded(random.direction()), .radiance = {1, 1, 1}};
    if (dot(shading_point.normal, light.axis) < 0) shading_point.normal = -shading_point.normal;
    shading_points.push(shading_point);
    const LightSamplePacket sample = sampled(shading_points.packet(0), light);
    ASSERT_EQ(sample.lit, 1u);
    const Vec3 expected = offset_origin(shading_point.point, shading_point.face, light.axis);
    ASSERT_EQ(sample.origin[0], expected);
    ASSERT_EQ(sample.distance[0], std::numeric_limits<double>::infinity());
  }
}

TEST(LightSamplePacket, AimsOnlyShadowRaysFromTheSmoothSurface) {
  Random random(13);
  for (std::uint64_t round = 0; round < effort::cases(1'000); ++round) {
    ShadingPointQueue queue;
    ShadingPoint shading_point = random_shading_point(random);
    const CompiledLight light = random_light(random);
    if (light.kind == light_kind<SpotLight>) continue;
    const Vec3 position = shading_point.point.position, offset = light.position - position;
    shading_point.normal = light.kind == light_kind<DirectionalLight> ? light.axis : normalize(offset);
    queue.push(shading_point);
    ShadingPointPacket smooth = queue.packet(0);
    smooth.smooth = true;
    smooth.shadow_offset.set(0, {random.in(-0.1, 0.1), random.in(-0.1, 0.1), random.in(-0.1, 0.1)});
    const LightSamplePacket sample = sampled(smooth, light), expected = sampled(queue.packet(0), light);
    ASSERT_EQ(sample.lit, expected.lit);
    ASSERT_EQ(sample.radiance[0], expected.radiance[0]) << "the light of the shading point";
    const Vec3 start = position + smooth.shadow_offset[0], from_start = light.position - start;
    const bool directional = light.kind == light_kind<DirectionalLight>;
    const Vec3 direction = directional ? light.axis : from_start / length(from_start);
    ASSERT_EQ(sample.shadow_direction[0], direction);
    ASSERT_EQ(sample.shadow_distance[0], directional ? std::numeric_limits<double>::infinity() : length(from_start));
    ASSERT_EQ(sample.origin[0], clear_of(start, shading_point.face, smooth.clearance[0], direction));
  }
}

TEST(LightSamplePacket, HasAUnitDirectionForALightAtTheStartOfItsShadowRay) {
  ShadingPointQueue queue;
  queue.push({.face = {0, 0, 1}, .normal = {0, 0, 1}, .to_eye = {0, 0, 1}, .diffuse = {1, 1, 1}});
  ShadingPointPacket smooth = queue.packet(0);
  smooth.smooth = true;
  smooth.shadow_offset.set(0, {0, 0, 0.5});
  const LightSamplePacket sample = sampled(smooth, {.position = {0, 0, 0.5}, .radiance = {1, 1, 1}});
  ASSERT_EQ(sample.lit & 1, 1u);
  EXPECT_EQ(sample.shadow_direction[0], (Vec3{0, 0, 1}));
  EXPECT_EQ(sample.shadow_distance[0], 0);
}

TEST(LightSamplePacket, LightsNeitherBlackPointsNorPointsAtTheLight) {
  ShadingPointQueue shading_points;
  const ShadingPoint at_light{.point = {{1, 2, 3}, {}}, .normal = {0, 0, 1}, .to_eye = {0, 0, 1}, .diffuse = {1, 1, 1}};
  shading_points.push(at_light);
  ShadingPoint black = at_light;
  black.point.position.z = 2;
  black.diffuse = {};
  shading_points.push(black);
  ShadingPoint below = at_light;
  below.point.position.z = 2;
  shading_points.push(below);
  const LightSamplePacket sample = sampled(shading_points.packet(0), {.position = {1, 2, 3}, .radiance = {1, 1, 1}});
  ASSERT_EQ(sample.lit, LaneMask{1} << 2) << "the point below the light";
  EXPECT_EQ(sample.radiance.r[2], 1);
}

TEST(LightSamplePacket, HasNoHighlightWithoutAHalfwayDirectionOrAlongTheSurface) {
  const Vec3 up{0, 0, 1}, aside{1, 0, 0}, between{0.6, 0, 0.8};
  for (const auto& [to_light, to_eye, shininess] :
       {std::tuple{up, -up, 32.0}, {aside, between, 0.0}, {aside, between, 32.0}}) {
    ShadingPointQueue queue;
    queue.push({.normal = up, .to_eye = to_eye, .specular = {1, 1, 1}, .shininess = shininess, .blinn = true});
    const LightSamplePacket sample =
        sampled(queue.packet(0), {.kind = light_kind<DirectionalLight>, .axis = to_light, .radiance = {1, 1, 1}});
    EXPECT_EQ(sample.lit == 0 ? 0 : sample.radiance.r[0], 0);
  }
}

TEST(ShadingPointQueue, IsEmptyAfterClear) {
  ShadingPointQueue shading_points;
  ShadingPoint shining{.normal = {0, 0, 1}, .specular = {1, 1, 1}, .blinn = true};
  for (int i = 0; i < lanes + 1; ++i) shading_points.push(shining);
  EXPECT_EQ(shading_points.packets(), 2u);
  shading_points.clear();
  EXPECT_EQ(shading_points.packets(), 0u);
  shading_points.push({.normal = {0, 0, 1}, .diffuse = {1, 1, 1}, .hit = 7});
  ASSERT_EQ(shading_points.packets(), 1u);
  EXPECT_EQ(shading_points.packet(0).count, 1);
  EXPECT_EQ(shading_points.packet(0).hit[0], 7u);
  EXPECT_FALSE(shading_points.packet(0).any_specular);
  EXPECT_FALSE(shading_points.packet(0).any_blinn);
}

}  // namespace
}  // namespace tracer
