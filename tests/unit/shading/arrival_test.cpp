// The light of one light at packets of places, beside its formulas in long double.
#include "tracer/src/integrator/arrival.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "tests/support/effort.h"
#include "tests/support/random.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;
using Kind = TraceLight::Kind;

Facing random_facing(Random& random) {
  const Vec3 position{random.in(-1, 1), random.in(-1, 1), random.in(-1, 1)};
  const double error = random.spread(1e-17, 1e-12);
  return {.point = {position, {error, 2 * error, 3 * error}},
          .face = rounded(random.direction()),
          .normal = rounded(random.direction()),
          .to_eye = rounded(random.direction()),
          .diffuse = {random.in(0, 1), random.in(0, 1), 0},
          .specular = random.chance(0.5) ? Color{} : Color{0, random.in(0, 1), random.in(0, 1)},
          .shininess = random.in(0, 9),
          .halfway = random.chance(0.5)};
}

TraceLight random_light(Random& random) {
  const Kind kinds[] = {Kind::point, Kind::spot, Kind::directional};
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

Real strength(const TraceLight& light, Real distance, const Vec& to_light) {
  if (light.kind == Kind::directional) return 1;
  Real f = 1;
  const auto& c = light.attenuation.coefficients;
  if (light.attenuation.kind == Attenuation::Kind::polynomial)
    f = std::fmin(1 / (c[0] + c[1] * distance + c[2] * distance * distance), 1.0L);
  if (light.attenuation.kind == Attenuation::Kind::inverse_square) f = 1 / (distance * distance);
  if (light.kind != Kind::spot) return f;
  const Real x = (dot(-to_light, Vec(light.axis)) - light.cos_outer) / (Real(light.cos_inner) - light.cos_outer);
  return f * (x <= 0 ? 0 : x >= 1 ? 1 : x * x * (3 - 2 * x));
}

Real highlight_of(const Facing& facing, const Vec& to_light) {
  const Vec n = facing.normal, v = facing.to_eye;
  const Real cosine = facing.halfway ? dot(n, unit(to_light + v)) : dot(2 * dot(n, to_light) * n - to_light, v);
  return std::pow(std::clamp(cosine, 0.0L, 1.0L), Real(facing.shininess));
}

TEST(Arrival, IsTheLocalModelOfEveryKindOfLightInEveryLane) {
  Random random(11);
  std::uint64_t lit = 0;
  for (std::uint64_t round = 0; round < effort::cases(3'000); ++round) {
    Facings facings;
    std::vector<Facing> all;
    for (int i = 0; i < 2 * lanes - 3; ++i) facings.push(all.emplace_back(random_facing(random)));
    const TraceLight light = random_light(random);
    const double world_per_trace = random.chance(0.5) ? 1 : 4, share = random.in(0.1, 1);
    for (std::size_t packet = 0; packet < facings.packets(); ++packet) {
      Arrival arrival;
      for (int i = 0; i < lanes; ++i) {
        arrival.from_x[i] = light.position.x;
        arrival.from_y[i] = light.position.y;
        arrival.from_z[i] = light.position.z;
      }
      arrive(facings.packet(packet), light, world_per_trace, share, arrival);
      for (int lane = 0; lane < facings.packet(packet).count; ++lane) {
        const Facing& facing = all[packet * lanes + static_cast<std::size_t>(lane)];
        const Vec offset = Vec(light.position) - Vec(facing.point.position);
        const Vec to_light = light.kind == Kind::directional ? Vec(light.axis) : unit(offset);
        const Real cosine = dot(Vec(facing.normal), to_light);
        if (std::fabs(cosine) < 1e-12L) continue;
        const Real power = share * strength(light, length(offset) * world_per_trace, to_light);
        const bool gains = (arrival.gaining >> lane & 1) != 0;
        ASSERT_EQ(gains, cosine > 0 && power > 0) << round << " lane " << lane;
        if (!gains) continue;
        ++lit;
        const Real spec = highlight_of(facing, to_light);
        const auto expect = [&](double got, double diffuse, double specular, double radiance) {
          const auto expected = static_cast<double>((diffuse * cosine + specular * spec) * power * radiance);
          EXPECT_NEAR(got, expected, 1e-12 * (expected + static_cast<double>(power))) << round << " lane " << lane;
        };
        expect(arrival.r[lane], facing.diffuse.r, facing.specular.r, light.radiance.r);
        expect(arrival.g[lane], facing.diffuse.g, facing.specular.g, light.radiance.g);
        expect(arrival.b[lane], facing.diffuse.b, facing.specular.b, light.radiance.b);
      }
    }
  }
  EXPECT_GT(lit, effort::cases(3'000)) << "some light must arrive";
}

TEST(Arrival, StartsShadowRaysWhereRaysThatLeaveTheSurfaceStart) {
  Random random(12);
  for (std::uint64_t round = 0; round < effort::cases(1'000); ++round) {
    Facings facings;
    Facing facing = random_facing(random);
    const TraceLight light{.kind = Kind::directional, .axis = rounded(random.direction()), .radiance = {1, 1, 1}};
    if (dot(facing.normal, light.axis) < 0) facing.normal = -facing.normal;
    facings.push(facing);
    Arrival arrival;
    arrive(facings.packet(0), light, 1, 1, arrival);
    ASSERT_EQ(arrival.gaining, 1u);
    const Vec3 expected = offset_origin(facing.point, facing.face, light.axis);
    ASSERT_EQ((Vec3{arrival.origin_x[0], arrival.origin_y[0], arrival.origin_z[0]}), expected);
    ASSERT_EQ(arrival.distance[0], std::numeric_limits<double>::infinity());
  }
}

TEST(Arrival, NothingComesFromALightThatTouchesTheSurfaceNorToAPlaceThatReflectsNothing) {
  Facings facings;
  const Facing touched{.point = {{1, 2, 3}, {}}, .normal = {0, 0, 1}, .to_eye = {0, 0, 1}, .diffuse = {1, 1, 1}};
  facings.push(touched);
  Facing black = touched;
  black.point.position.z = 2;
  black.diffuse = {};
  facings.push(black);
  Facing below = touched;
  below.point.position.z = 2;
  facings.push(below);
  Arrival arrival;
  for (int i = 0; i < lanes; ++i) {
    arrival.from_x[i] = 1;
    arrival.from_y[i] = 2;
    arrival.from_z[i] = 3;
  }
  arrive(facings.packet(0), {.radiance = {1, 1, 1}}, 1, 1, arrival);
  ASSERT_EQ(arrival.gaining, LaneMask{1} << 2) << "the place below the light";
  EXPECT_EQ(arrival.r[2], 1);
}

TEST(Facings, KeepNothingOfThoseBefore) {
  Facings facings;
  Facing shining{.normal = {0, 0, 1}, .specular = {1, 1, 1}, .halfway = true};
  for (int i = 0; i < lanes + 1; ++i) facings.push(shining);
  EXPECT_EQ(facings.packets(), 2u);
  facings.clear();
  EXPECT_EQ(facings.packets(), 0u);
  facings.push({.normal = {0, 0, 1}, .diffuse = {1, 1, 1}, .hit = 7});
  ASSERT_EQ(facings.packets(), 1u);
  EXPECT_EQ(facings.packet(0).count, 1);
  EXPECT_EQ(facings.packet(0).hit[0], 7u);
  EXPECT_FALSE(facings.packet(0).any_shines);
  EXPECT_FALSE(facings.packet(0).any_halfway);
}

}  // namespace
}  // namespace tracer
