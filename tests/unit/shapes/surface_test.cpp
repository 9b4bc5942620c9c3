// Surface data of hits: points within their error bounds, normals, sides, texture coordinates.
#include "tracer/src/interaction/surface.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/support/scenes.h"
#include "tests/unit/shapes/look.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;

constexpr Real pi = std::numbers::pi_v<Real>;

// ---- spheres -------------------------------------------------------------------------------------------------------

/// Spheres of random size and position in a scene of fixed extent, and rays from near, far and inside.
TEST(SphereSurface, BoundsTheErrorOfThePointSoThatLeavingRaysDoNotHitItAgain) {
  Random random(1);
  std::uint64_t hits = 0;
  const std::uint64_t spheres = effort::cases(16'000);
  for (std::uint64_t i = 0; i < spheres; ++i) {
    Scene scene = scenes::empty(1);
    const double radius = random.spread(1e-9, 0.4);
    scenes::add(scene, Sphere{random.vector(0.5 - radius), radius}, scenes::matte({1, 1, 1}));
    // Other spheres fix the render space, far from the rays.
    for (const double corner : {-4.0, 4.0}) scenes::add(scene, Sphere{{corner, corner, corner}, 1e-3}, MaterialId{0});
    const auto c = compiled(scene);
    const SphereGeometry& geometry = c->geometry().spheres[0];
    const Vec center(geometry.x[0], geometry.y[0], geometry.z[0]);
    const Real r = geometry.radius[0];
    for (int ray = 0; ray < 100; ++ray) {
      const bool inside = random.chance(0.3);
      const Real distance = inside ? random.in(0, 0.99) : random.chance(0.3) ? random.spread(1 + 1e-6, 1e4) : 2.0;
      const Vec origin = center + distance * r * random.direction();
      Vec target = center + random.in(0, 1) * r * random.direction();
      if (!inside && random.chance(0.3)) {
        // Grazing: the tangent cone's rim, from just within.
        const Vec axis = unit(origin - center);
        const Real cosine = 1 / distance, sine = std::sqrt(1 - cosine * cosine);
        target = center + (1 - random.spread(1e-15, 1e-3)) * r * (cosine * axis + sine * random.across(axis));
      }
      const Look at = look(*c, rounded(origin), rounded(unit(target - origin)));
      if (!at.found || at.surface.object != 0) continue;
      ++hits;
      const Vec p = at.surface.point.position;
      const Vec n = unit(p - center);
      ASSERT_LE(std::fabs(length(p - center) - r), error_along(at.surface, n)) << "radius " << r;
      ASSERT_LE(error_along(at.surface, n), 64 * 0x1p-53L * (r + length(center))) << "no looser than needed";
      ASSERT_LE(length(Vec(at.surface.geometric_normal) - n), 4 * 0x1p-53L * (1 + length(p) / r));
      const Real towards = dot(Vec(at.surface.normal), unit(target - origin));
      ASSERT_LE(towards, 1e-12L) << "the normal is on the ray's side";
      // At the very silhouette, the ray runs along the surface to the last digits: then either side may be reported.
      if (std::fabs(dot(n, unit(target - origin))) > 1e-11L * distance) {
        ASSERT_EQ(at.surface.back, inside);
      }

      const auto direction = leaving(random, at.surface, n);
      if (!direction) continue;
      const Vec3 start = offset_origin(at.surface.point, at.surface.geometric_normal, *direction);
      ASSERT_GT(length(Vec(start) - center), r) << "radius " << r;
      const Look again = look(*c, start, *direction, at.hit.primitive);
      ASSERT_FALSE(again.found && again.surface.object == 0) << "self-hit at " << again.hit.t << ", radius " << r;
      // And one that enters.
      const Vec3 back = offset_origin(at.surface.point, at.surface.geometric_normal, -*direction);
      ASSERT_LT(length(Vec(back) - center), r) << "radius " << r;
    }
  }
  EXPECT_GT(hits, spheres * 50);
}

TEST(SphereSurface, HasLongitudeAndLatitudeAsTextureCoordinates) {
  Random random(2);
  for (std::uint64_t i = 0; i < effort::cases(6000); ++i) {
    Sphere sphere{random.vector(1), 1, random.vector(5), random.vector(5)};
    if (i % 3 == 0) sphere.axis = {0, 1, 0}, sphere.meridian = {1, 0, 0};
    const auto c = compiled(checkered(sphere));
    const Vec center(c->geometry().spheres[0].x[0], c->geometry().spheres[0].y[0], c->geometry().spheres[0].z[0]);
    const Vec pole = unit(sphere.axis), e0 = unit(Vec(sphere.meridian) - dot(Vec(sphere.meridian), pole) * pole);
    const Vec e1 = cross(pole, e0);
    for (int ray = 0; ray < 50; ++ray) {
      Vec n = random.direction();
      const Real turn = random.sign() * random.spread(1e-18, 1e-3);
      if (ray % 3 == 0) n = unit(std::cos(turn) * e0 + std::sin(turn) * e1 + random.in(-2, 2) * pole);  // the seam
      if (ray % 3 == 1) n = unit(random.sign() * pole + turn * random.across(pole));                    // the poles
      const Vec origin = center + n;
      const Look at = look(*c, rounded(origin), rounded(-n));
      ASSERT_TRUE(at.found);
      const Vec m = unit(Vec(at.surface.point.position) - center);
      Real u = std::atan2(dot(m, e1), dot(m, e0)) / (2 * pi);
      if (u < 0) u += 1;
      const Real v = 1 - std::atan2(length(cross(m, pole)), dot(m, pole)) / pi;
      ASSERT_TRUE(at.surface.uv.x >= 0 && at.surface.uv.x < 1) << at.surface.uv.x;
      const Real from_pole = length(cross(m, pole));
      const Real error = std::fabs(at.surface.uv.x - u);
      ASSERT_LE(std::fmin(error, 1 - error), 2e-15L / from_pole) << "u " << u;  // the seam may round either way
      ASSERT_NEAR(at.surface.uv.y, static_cast<double>(v), 3e-15);
    }
  }
}

TEST(SphereSurface, HasLongitudeZeroAtThePoles) {
  const auto c = compiled(checkered(Sphere{{0, 0, 0}, 1}));
  const Vec3 center{c->geometry().spheres[0].x[0], c->geometry().spheres[0].y[0], c->geometry().spheres[0].z[0]};
  const Look north = look(*c, center + Vec3{0, 2, 0}, {0, -1, 0}), south = look(*c, center - Vec3{0, 2, 0}, {0, 1, 0});
  EXPECT_EQ(north.surface.uv, (Vec2{0, 1}));
  EXPECT_EQ(south.surface.uv, (Vec2{0, 0}));
}

// ---- planes --------------------------------------------------------------------------------------------------------

TEST(PlaneSurface, BoundsTheErrorOfThePoint) {
  Random random(3);
  std::uint64_t hits = 0;
  for (std::uint64_t i = 0; i < effort::cases(25'000); ++i) {
    Scene scene = scenes::empty(1);
    const Vec3 axes[] = {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}};
    const Vec3 normal = random.chance(0.3) ? axes[random.below(3)] : random.vector(7);
    scenes::add(scene, Plane{random.vector(random.spread(1e-3, 1e9)), normal, {}}, scenes::matte({1, 1, 1}));
    const auto c = compiled(scene);
    const Vec n = c->geometry().planes.normal[0], point = c->geometry().planes.point[0];
    ASSERT_LE(length(n - unit(normal)), 4 * 0x1p-53L);
    for (int ray = 0; ray < 100; ++ray) {
      const Vec direction = random.chance(0.5)
                                ? random.direction()
                                : unit(random.across(n) + random.sign() * random.spread(1e-12, 1e-2) * n);
      const Vec origin = random.spread(1e-3, 1e6) * random.direction();
      const Look at = look(*c, rounded(origin), rounded(direction));
      if (!at.found) continue;
      ++hits;
      const Vec p = at.surface.point.position;
      ASSERT_LE(std::fabs(dot(n, p - point)), error_along(at.surface, n)) << "t " << at.hit.t;
      ASSERT_LE(error_along(at.surface, n), 64 * 0x1p-53L * (length(p) + length(point)));
      ASSERT_EQ(at.surface.back, dot(Vec(rounded(direction)), n) > 0);
      ASSERT_LE(dot(Vec(at.surface.normal), direction), 1e-15L);
      const Vec3 away = rounded(random.direction());
      const Real side = dot(away, c->geometry().planes.normal[0]) < 0 ? -1 : 1;
      const Vec start = offset_origin(at.surface.point, at.surface.geometric_normal, away);
      ASSERT_GE(side * dot(n, start - point), 0) << "on the wrong side";
    }
  }
  EXPECT_GT(hits, effort::cases(25'000) * 40);
}

TEST(PlaneSurface, HasTextureCoordinatesAlongTheXAxisOrZForANormalAlongX) {
  struct Case {
    Vec3 normal;
    std::optional<Vec3> u_axis;
    Vec3 e0, e1;
  };
  const Case cases[] = {{{0, 1, 0}, {}, {1, 0, 0}, {0, 0, -1}},
                        {{0, -3, 0}, {}, {1, 0, 0}, {0, 0, 1}},
                        {{0, 0, 2}, {}, {1, 0, 0}, {0, 1, 0}},
                        {{5, 0, 0}, {}, {0, 0, 1}, {0, -1, 0}},
                        {{-1, 0, 0}, {}, {0, 0, 1}, {0, 1, 0}},
                        {{0, 1, 0}, Vec3{0, 7, 2}, {0, 0, 1}, {1, 0, 0}},
                        {{0, 1, 0}, Vec3{-1, 0, 0}, {-1, 0, 0}, {0, 0, 1}}};
  for (const Case& k : cases) {
    const auto c = compiled(checkered(Plane{{10, 20, 30}, k.normal, k.u_axis}));
    const Vec3 point = c->geometry().planes.point[0], n = c->geometry().planes.normal[0];
    for (const auto& [u, v] : {std::pair{0.0, 0.0}, {3.0, 0.0}, {0.0, -4.5}, {-1e6, 2e6}}) {
      const Vec3 at = point + k.e0 * u + k.e1 * v;
      const Look hit = look(*c, at + n, -n);
      ASSERT_TRUE(hit.found);
      EXPECT_NEAR(hit.surface.uv.x, u, 1e-15 * std::abs(u) + 1e-13) << k.normal.x << k.normal.y << k.normal.z;
      EXPECT_NEAR(hit.surface.uv.y, v, 1e-15 * std::abs(v) + 1e-13);
    }
  }
}

TEST(Axes, AreOrthonormalAndRightHandedForAFirstAxisNextToTheNormal) {
  Random random(4);
  for (std::uint64_t i = 0; i < effort::cases(20'000); ++i) {
    const Vec3 n = rounded(random.direction());
    const Vec first = unit(Vec(n) + random.spread(1e-12, 10) * random.across(n));
    const Axes axes = axes_across(n, rounded(static_cast<Real>(random.spread(1e-30, 1e30)) * first));
    ASSERT_NEAR(dot(axes.e0, n), 0, 1e-15);
    ASSERT_NEAR(dot(axes.e1, n), 0, 1e-15);
    ASSERT_NEAR(dot(axes.e0, axes.e1), 0, 1e-15);
    ASSERT_NEAR(length(axes.e0), 1, 1e-15);
    ASSERT_NEAR(dot(cross(n, axes.e0), axes.e1), 1, 1e-15);
    ASSERT_GT(dot(Vec(axes.e0), first), 0);
  }
}

// ---- triangles -----------------------------------------------------------------------------------------------------

TEST(TriangleSurface, BoundsTheErrorOfThePointAndInterpolatesNormalsAndCoordinates) {
  Random random(5);
  std::uint64_t hits = 0;
  for (std::uint64_t i = 0; i < effort::cases(60'000); ++i) {
    Triangle triangle{{{random.vector(1), random.vector(1), random.vector(1)}}, {}, {}};
    const std::array<Vec3, 3> normals{rounded(random.direction()), rounded(random.direction()),
                                      rounded(random.direction())};
    triangle.normals = normals;
    triangle.uvs = std::array<Vec2, 3>{Vec2{random.in(-5, 5), 0}, Vec2{0, random.in(-5, 5)}, Vec2{1e6, 1}};
    const auto c = compiled(checkered(triangle));
    const TriangleGeometry& g = c->geometry().triangles[0];
    const Vec a = g.position(0), b = g.position(1), d = g.position(2);
    const Vec area = cross(b - a, d - a);
    if (length(area) < 1e-3L) continue;
    const Vec n = unit(area);
    for (int ray = 0; ray < 20; ++ray) {
      Real u = random.in(0, 1), v = random.in(0, 1);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const Vec target = (1 - u - v) * a + u * b + v * d;
      const Vec origin = target + random.direction();
      const Look at = look(*c, rounded(origin), rounded(unit(target - origin)));
      if (!at.found) continue;
      ++hits;
      const Vec p = at.surface.point.position;
      ASSERT_LE(std::fabs(dot(n, p - a)), error_along(at.surface, n));
      ASSERT_LE(length(Vec(at.surface.geometric_normal) - n), 1e-12L);
      const bool back = dot(target - origin, n) > 0;
      ASSERT_EQ(at.surface.back, back);
      // The reported point is where the barycentric coordinates are; near the line of sight, within their conditioning.
      ASSERT_LE(length(p - target), 1e-10L);
      Vec bent = (1 - u - v) * Vec(normals[0]) + u * Vec(normals[1]) + v * Vec(normals[2]);
      if (length(bent) < 0.1L || std::fabs(dot(bent, n)) < 1e-3L) continue;
      bent = unit(dot(bent, n) < 0 ? -bent : bent);
      if (back) bent = -bent;
      ASSERT_LE(length(Vec(at.surface.normal) - bent), 1e-5L) << "normals are kept as floats";
      const auto& uvs = *triangle.uvs;
      ASSERT_NEAR(at.surface.uv.x, static_cast<double>((1 - u - v) * uvs[0].x + v * uvs[2].x), 1e-3);
      ASSERT_NEAR(at.surface.uv.y, static_cast<double>(u * uvs[1].y + v), 1e-9);
    }
  }
  EXPECT_GT(hits, effort::cases(60'000) * 10);
}

TEST(MeshSurface, WeightsSmoothNormalsByTheAreasOfTheFaces) {
  // A corner where a large and a small face meet at a right angle.
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 0, -1}, {0, 0, 1}, {-3, 0, 0}, {0, 2, 0}, {0, 0, 2}};
  mesh.triangles = {{0, 1, 2}, {0, 6, 5}};  // twice the areas: 1 up, 4 along -x
  mesh.smooth = true;
  const auto c = compiled(checkered(mesh));
  const auto& normal = c->geometry().triangles[0].normals[0];
  const Vec expected = unit(Vec(cross(Vec(1, 0, 0), Vec(0, 0, -1)) + cross(Vec(0, 0, 2), Vec(0, 2, 0))));
  EXPECT_NEAR(normal[0], static_cast<double>(expected.x), 1e-7);
  EXPECT_NEAR(normal[1], static_cast<double>(expected.y), 1e-7);
  EXPECT_NEAR(normal[2], static_cast<double>(expected.z), 1e-7);
  // A position that no face uses, and one whose faces cancel, fall back to the face's normal: zero means that.
  EXPECT_EQ(c->geometry().triangles[0].normals[3], (std::array<float, 3>{0, 0, 0}));
}

TEST(MeshSurface, IsFlatWithoutNormalsAndBarycentricWithoutCoordinates) {
  const auto c = compiled(checkered(scenes::icosphere(1)));
  const Look at = look(*c, c->frame.render_from_world(Vec3{0.1, 0.2, 3}), {0, 0, -1});
  ASSERT_TRUE(at.found);
  EXPECT_EQ(at.surface.normal, at.surface.geometric_normal);
  EXPECT_EQ(at.surface.uv, (Vec2{at.hit.u, at.hit.v}));
}

}  // namespace
}  // namespace tracer
