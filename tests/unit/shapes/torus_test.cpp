// Hits, texture coordinates and error bounds on tori, against closed forms in long double. A torus is not convex: a ray
// that leaves its inner side may hit the opposite side.
#include <gtest/gtest.h>

#include <numbers>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/unit/shapes/look.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;

constexpr Real pi = std::numbers::pi_v<Real>;
constexpr double ratios[] = {1e-6, 1e-3, 0.25, 0.9, 0.999};

/// A compiled torus, parametrized in its own space: the center of the tube is at the angle phi, psi turns around the
/// tube from the outer equator. Lengths are in units of the major radius.
class CompiledTorus {
 public:
  CompiledTorus(Random& random, double ratio, double scale) {
    const Vec3 center = random.vector(3 * scale);
    scene_ = compiled(checkered(Torus{center, rounded(random.direction()), scale, ratio * scale, {}}));
    quadric_ = &scene_->geometry().quadrics.at(0).quadrics.at(0);
  }

  [[nodiscard]] const CompiledScene& scene() const { return *scene_; }
  [[nodiscard]] Real tube() const { return quadric_->radius_0; }
  [[nodiscard]] Real size() const { return length(Vec(quadric_->render_from_shape.x)); }

  [[nodiscard]] Vec direction(const Vec& d) const {
    const Linear& m = quadric_->render_from_shape;
    return unit(d.x * Vec(m.x) + d.y * Vec(m.y) + d.z * Vec(m.z));
  }
  [[nodiscard]] Vec normal(Real phi, Real psi) const {
    return direction({std::cos(psi) * std::cos(phi), std::cos(psi) * std::sin(phi), std::sin(psi)});
  }
  /// The point at `height` above the surface.
  [[nodiscard]] Vec point(Real phi, Real psi, Real height = 0) const {
    const Vec ring = direction({std::cos(phi), std::sin(phi), 0});
    return Vec(quadric_->origin) + size() * (ring + (tube() + height) * normal(phi, psi));
  }

  /// The hit of a ray that approaches the surface point from outside, along the normal.
  [[nodiscard]] Look look_at(Real phi, Real psi) const {
    const Real height = 0.1L * std::fmin(tube(), 1 - tube());
    return look(*scene_, rounded(point(phi, psi, height)), rounded(-normal(phi, psi)));
  }

 private:
  std::shared_ptr<const CompiledScene> scene_;
  const Quadric* quadric_;
};

/// Calls `test(torus)` for tori of all ratios and scales.
template <class Test>
void for_tori(std::uint64_t seed, const Test& test) {
  Random random(seed);
  for (const double ratio : ratios)
    for (const double scale : {1.0, 1e-55, 1e55, 1e-100, 1e100}) {
      SCOPED_TRACE(testing::Message() << "minor over major radius " << ratio << ", scale " << scale);
      for (std::uint64_t i = 0; i < effort::cases(4); ++i) test(random, CompiledTorus(random, ratio, scale));
      if (testing::Test::HasFatalFailure()) return;
    }
}

Real distance_on_circle(Real a, Real b) { return std::fabs(std::remainder(a - b, 1.0L)); }

TEST(Torus, HasTheTextureCoordinatesOfTheClosedForm) {
  for_tori(1, [](Random& random, const CompiledTorus& torus) {
    for (int i = 0; i < 100; ++i) {
      const Real phi = 2 * pi * random.in(0, 1), psi = 2 * pi * random.in(0, 1);
      const Look at = torus.look_at(phi, psi);
      ASSERT_TRUE(at.found);
      const Real r = 1 + torus.tube() * std::cos(psi), rounding = 64 * 0x1p-53L;
      EXPECT_LE(distance_on_circle(at.surface.uv.x, phi / (2 * pi)), rounding / r);
      EXPECT_LE(distance_on_circle(at.surface.uv.y, psi / (2 * pi)), rounding / torus.tube());
      EXPECT_LE(length(Vec(at.surface.geometric_normal) - torus.normal(phi, psi)),
                8 * rounding / std::fmin(torus.tube(), r));
      const Vec3& error = at.surface.point.error;
      const Vec off = Vec(at.surface.point.position) - torus.point(phi, psi);
      const Real along = std::fabs(dot(off, torus.normal(phi, psi)));
      EXPECT_LE(along, length(Vec(error)) + rounding * torus.size()) << "next to the surface";
    }
  });
}

TEST(Torus, MeasuresTextureCoordinatesFromItsAxes) {
  const auto scene = compiled(checkered(Torus{{1, 2, 3}, {0, 1, 0}, 2, 0.5, Vec3{0, 0, 1}}));
  const auto expect_uv = [&](const Vec3& place, const Vec3& normal, const Vec2& uv) {
    const Look at = look(*scene, scene->frame.render_from_world(place + normal), -normal);
    ASSERT_TRUE(at.found);
    EXPECT_LE(distance_on_circle(at.surface.uv.x, uv.x), 1e-14L);
    EXPECT_LE(distance_on_circle(at.surface.uv.y, uv.y), 1e-14L);
  };
  expect_uv({1, 2, 5.5}, {0, 0, 1}, {0, 0});
  expect_uv({3.5, 2, 3}, {1, 0, 0}, {0.25, 0});
  expect_uv({1, 2.5, 5}, {0, 1, 0}, {0, 0.25});
  expect_uv({1, 1.5, 1}, {0, -1, 0}, {0.5, 0.75});
}

/// In the meridian plane the torus is two circles: the inward normal of one leaves it at the opposite point, and the
/// outward normal hits the other on the inner side only.
TEST(Torus, IsHitAgainAlongTheInwardNormalAndAcrossTheHole) {
  std::uint64_t across = 0;
  for_tori(2, [&](Random& random, const CompiledTorus& torus) {
    const Real a = torus.tube();
    for (int i = 0; i < 100; ++i) {
      const bool inner = random.chance(0.5);
      const Real phi = 2 * pi * random.in(0, 1);
      const Real psi =
          inner ? pi + std::asin(std::fmin(1.0L, a / 2)) * Real(random.in(-2, 2)) : 2 * pi * random.in(0, 1);
      const Look at = torus.look_at(phi, psi);
      ASSERT_TRUE(at.found);
      const auto hit_along = [&](const Vec& normal) {
        const Vec3 direction = rounded(normal);
        return look(torus.scene(), offset_origin(at.surface.point, at.surface.geometric_normal, direction), direction,
                    at.hit.primitive);
      };
      const Look inside = hit_along(-torus.normal(phi, psi));
      ASSERT_TRUE(inside.found) << "psi " << psi;
      EXPECT_TRUE(inside.surface.back);
      EXPECT_LE(length(Vec(inside.surface.point.position) - torus.point(phi, psi + pi)), 1e-14L * torus.size());

      const Real miss = 2 * std::fabs(std::sin(psi)) - a;  // of the other circle
      if (std::cos(psi) < 0 && std::fabs(miss) < 1e-2L * a) continue;
      const bool expected = std::cos(psi) < 0 && miss < 0;
      const Look next = hit_along(torus.normal(phi, psi));
      ASSERT_EQ(next.found, expected) << "psi " << psi;
      if (!expected) continue;
      ++across;
      const Real t = -2 * std::cos(psi) - std::sqrt(a * a - 4 * std::sin(psi) * std::sin(psi)) - a;
      EXPECT_NEAR(static_cast<double>(next.hit.t / torus.size()), static_cast<double>(t), 1e-12);
      EXPECT_FALSE(next.surface.back);
    }
  });
  EXPECT_GT(across, effort::cases(500));
}

/// The outer half is part of the convex hull: a tangent plane there touches the torus in one point only.
TEST(Torus, IsHitByRaysBelowATangentOfItsOuterHalfAndNotByRaysAbove) {
  Random random(5);
  for (const double ratio : {0.01, 0.25, 0.999})
    for (std::uint64_t i = 0; i < effort::cases(2000); ++i) {
      const CompiledTorus torus(random, ratio, 1);
      const Real a = torus.tube(), phi = 2 * pi * random.in(0, 1), psi = random.in(-1.2, 1.2),
                 turn = random.in(0, 6.28);
      const Vec along_ring = torus.direction({-std::sin(phi), std::cos(phi), 0});
      const Vec along_tube = torus.normal(phi, psi + pi / 2);
      const Vec d = std::cos(turn) * along_ring + std::sin(turn) * along_tube;
      const Real curvature = std::cos(turn) * std::cos(turn) * std::cos(psi) / (1 + a * std::cos(psi)) +
                             std::sin(turn) * std::sin(turn) / a;
      const Real height = a * Real(random.spread(1e-10, 1e-4));
      const auto look_along = [&](Real h) {
        return look(torus.scene(), rounded(torus.point(phi, psi, h) - 3 * torus.size() * d), rounded(d));
      };
      ASSERT_FALSE(look_along(height).found) << "height " << static_cast<double>(height);
      const Look below = look_along(-height);
      ASSERT_TRUE(below.found) << "depth " << static_cast<double>(height);
      const Real half_chord = std::sqrt(2 * height / curvature);
      EXPECT_NEAR(static_cast<double>(below.hit.t / torus.size()), static_cast<double>(3 - half_chord),
                  static_cast<double>(half_chord));
    }
}

}  // namespace
}  // namespace tracer
