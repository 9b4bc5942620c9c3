// Surface data of hits on discs, cylinders, cones, boxes and ellipsoids: points within their error bounds, normals,
// texture coordinates; and rays do not leave closed shapes without a hit.
#include <gtest/gtest.h>

#include <numbers>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/unit/accel/quadric_oracle.h"
#include "tests/unit/shapes/look.h"
#include "tracer/src/scene/instancing.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;

constexpr Real pi = std::numbers::pi_v<Real>;

Transform random_transform(Random& random) {
  Transform t;
  Linear m;
  do {
    const auto column = [&] { return rounded(static_cast<Real>(random.spread(0.2, 3)) * random.direction()); };
    m = {column(), column(), column()};
  } while (std::abs(determinant({normalize(m.x), normalize(m.y), normalize(m.z)})) < 0.05);
  const Vec3 by = random.vector(5);
  t.rows = {{{m.x.x, m.y.x, m.z.x, by.x}, {m.x.y, m.y.y, m.z.y, by.y}, {m.x.z, m.y.z, m.z.z, by.z}}};
  return t;
}

/// A closed shape: rays from outside enter it as often as they leave it.
Shape closed_shape(Random& random, std::uint32_t which) {
  switch (which % 5) {
    case 0:
      return Box{{-1, -0.5, -2}, {0.5, 1, 3}};
    case 1:
      return Cylinder{random.vector(1), random.vector(3), random.spread(0.05, 2), true, {}};
    case 2:
      return Cone{random.vector(1), random.vector(3), random.spread(0.05, 2), 0, true, {}};
    case 3:
      return Cone{random.vector(1), random.vector(3), random.spread(0.05, 2), random.spread(0.05, 2), true, {}};
    default:
      return Sphere{random.vector(1), random.spread(0.05, 2)};
  }
}

/// A point on an edge, rim or corner, or the apex, in the standard shape's space.
Vec edge_of(Random& random, const Quadric& q) {
  const Real turn = 2 * pi * random.in(0, 1);
  const Real z = random.below(2);
  if (q.kind == kind_of<UnitCube>) {
    std::array<Real, 3> p{static_cast<Real>(random.below(2)), static_cast<Real>(random.below(2)),
                          static_cast<Real>(random.below(2))};
    if (random.chance(0.7)) p[random.below(3)] = random.in(0, 1);
    return {p[0], p[1], p[2]};
  }
  if (q.kind == kind_of<UnitSphere>) return random.direction();
  const Real r = z > 0 ? q.radius_1 : q.radius_0;
  return {r * std::cos(turn), r * std::sin(turn), z};
}

TEST(ClosedShapes, AreNotLeftWithoutAHitAtRimsEdgesCornersAndApex) {
  Random random(1);
  std::uint64_t rays = 0, leaks = 0;
  for (std::uint32_t i = 0; i < effort::cases(1500); ++i) {
    const auto c = compiled(checkered(closed_shape(random, i), random_transform(random)));
    const Quadric& q = c->geometry().quadrics.at(0).quadrics.at(0);
    for (int ray = 0; ray < 70; ++ray) {
      const double low = q.kind == kind_of<UnitSphere> ? -0.5 : 0.05;
      const Vec3 inside =
          q.origin + q.render_from_shape * Vec3{random.in(0.01, 0.03), random.in(0.01, 0.03), random.in(low, 0.5)};
      const Vec3 target = q.origin + q.render_from_shape * rounded(edge_of(random, q));
      const bool well_inside = q.kind != kind_of<Frustum> || std::min(q.radius_0, q.radius_1 * 2 + 0.1) > 0.1;
      if (!well_inside) continue;
      ++rays;
      leaks += look(*c, inside, normalize(target - inside)).found ? 0 : 1;
    }
  }
  EXPECT_GT(rays, effort::cases(1500) * 40);
  EXPECT_EQ(leaks, 0u) << "of " << rays;
}

/// Signed distance of a point in the shape's space from the surface of a part.
struct Beyond {
  Real distance = 0;
  Vec gradient;  ///< gradient of the distance, in the shape's space
};

Beyond beyond(const Quadric& q, QuadricPart part, const Vec& p) {
  switch (part) {
    case QuadricPart::side: {
      if (q.kind == kind_of<UnitSphere>) return {length(p) - 1, unit(p)};
      const Real slope = Real(q.radius_1) - q.radius_0, r = std::hypot(p.x, p.y);
      return {r - (q.radius_0 + slope * p.z), Vec(p.x / r, p.y / r, -slope)};
    }
    case QuadricPart::x_0:
      return {-p.x, {-1, 0, 0}};
    case QuadricPart::x_1:
      return {p.x - 1, {1, 0, 0}};
    case QuadricPart::y_0:
      return {-p.y, {0, -1, 0}};
    case QuadricPart::y_1:
      return {p.y - 1, {0, 1, 0}};
    case QuadricPart::cap_0:
    case QuadricPart::z_0:
      return {-p.z, {0, 0, -1}};
    case QuadricPart::cap_1:
    case QuadricPart::z_1:
      return {q.kind == kind_of<UnitDisc> ? p.z : p.z - 1, {0, 0, 1}};
  }
  return {};
}

Shape any_shape(Random& random, std::uint32_t which) {
  if (which % 6 == 5)
    return Disc{random.vector(1), random.vector(1), 2, random.chance(0.5) ? 0 : random.in(0, 1.9), {}};
  return closed_shape(random, which % 6);
}

TEST(QuadricSurface, BoundsTheErrorOfPointsAndLeavingRaysDoNotHitItAgain) {
  Random random(2);
  std::uint64_t hits = 0;
  for (std::uint32_t i = 0; i < effort::cases(25'000); ++i) {
    const auto transform = random.chance(0.7) ? std::optional(random_transform(random)) : std::nullopt;
    if (!transform && i % 6 == 4) continue;  // that sphere is no quadric
    const auto c = compiled(checkered(any_shape(random, i), transform));
    const Quadric& q = c->geometry().quadrics.at(0).quadrics.at(0);
    const Map map(q);
    for (int ray = 0; ray < 100; ++ray) {
      const Vec3 inside = q.origin + q.render_from_shape * Vec3{random.in(0, 0.6), random.in(0, 0.6), random.in(0, 1)};
      const Real distance = random.chance(0.2) ? 1e4 : random.chance(0.3) ? 0 : 2;
      const Vec3 direction = rounded(random.direction());
      const Look at = look(*c, rounded(Vec(inside) - distance * Vec(direction)), direction);
      if (!at.found) continue;
      ++hits;
      const auto part = static_cast<QuadricPart>(at.hit.u);
      const Vec p = map.shape_point(at.surface.point.position);
      const auto [off, gradient] = beyond(q, part, p);
      const Vec image = map.gradient(gradient);
      const Vec normal = unit(image);
      ASSERT_LE(std::fabs(off) / length(image), error_along(at.surface, normal))
          << "part " << static_cast<int>(part) << " shape " << i % 6;
      const bool at_apex = part == QuadricPart::side && std::hypot(p.x, p.y) < 1e-4L;
      if (!at_apex) {
        ASSERT_LE(length(Vec(at.surface.geometric_normal) - normal), 1e-9L) << "part " << static_cast<int>(part);
      }
      ASSERT_EQ(at.surface.back, dot(direction, at.surface.geometric_normal) > 0);
      const Real lean = std::fabs(dot(normal, Vec(direction)));
      if (q.kind != kind_of<UnitDisc> && lean > 1e-6L && distance == 2) {
        ASSERT_EQ(at.surface.back, dot(Vec(direction), normal) > 0);
      }
      const auto away = leaving(random, at.surface, normal);
      if (at_apex || !away) continue;
      const Vec3 start = offset_origin(at.surface.point, at.surface.geometric_normal, *away);
      ASSERT_FALSE(look(*c, start, *away, at.hit.primitive).found)
          << "part " << static_cast<int>(part) << " shape " << i % 6;
    }
  }
  EXPECT_GT(hits, effort::cases(25'000) * 40);
}

struct Expected {
  Vec3 place, normal;
  Vec2 uv;
};

void expect_at(const Shape& shape, const std::vector<Expected>& all) {
  const auto c = compiled(checkered(shape));
  for (const auto& [place, normal, uv] : all) {
    const Look at = look(*c, c->frame.render_from_world(place) + normalize(normal), -normalize(normal));
    ASSERT_TRUE(at.found) << place.x << " " << place.y << " " << place.z;
    EXPECT_NEAR(at.surface.uv.x, uv.x, 1e-13) << "u at " << place.x << " " << place.y << " " << place.z;
    EXPECT_NEAR(at.surface.uv.y, uv.y, 1e-13) << "v at " << place.x << " " << place.y << " " << place.z;
    EXPECT_LE(length(Vec(at.surface.geometric_normal) - unit(Vec(normal))), 1e-14L);
  }
}

TEST(TextureCoordinates, OfADiscSpanItsSquareForTheDefaultAndAGivenFirstAxis) {
  expect_at(
      Disc{{1, 2, 3}, {0, 0, 5}, 2, 0, {}},
      {{{1, 2, 3}, {0, 0, 1}, {0.5, 0.5}}, {{2, 2, 3}, {0, 0, 1}, {0.75, 0.5}}, {{1, 3, 3}, {0, 0, 1}, {0.5, 0.75}}});
  expect_at(Disc{{1, 2, 3}, {0, 0, 5}, 2, 0, Vec3{0, 1, 7}},
            {{{1, 3, 3}, {0, 0, 1}, {0.75, 0.5}}, {{2, 2, 3}, {0, 0, 1}, {0.5, 0.25}}});
  expect_at(Disc{{0, 0, 0}, {1, 0, 0}, 1, 0, {}}, {{{0, 0, 0.5}, {1, 0, 0}, {0.75, 0.5}}});
}

TEST(TextureCoordinates, OfACylinderAreAngleAndHeightAndOfItsCapsThoseOfADisc) {
  // Axis z, e0 = x, e1 = y.
  expect_at(Cylinder{{0, 0, 0}, {0, 0, 4}, 2, true, {}}, {{{2, 0, 1}, {1, 0, 0}, {0, 0.25}},
                                                          {{0, 2, 3}, {0, 1, 0}, {0.25, 0.75}},
                                                          {{-2, 0, 2}, {-1, 0, 0}, {0.5, 0.5}},
                                                          {{0, -2, 2}, {0, -1, 0}, {0.75, 0.5}},
                                                          {{1, 0, 4}, {0, 0, 1}, {0.75, 0.5}},
                                                          {{0, 1, 0}, {0, 0, -1}, {0.5, 0.75}}});
  expect_at(Cylinder{{0, 0, 0}, {0, 0, 4}, 2, true, Vec3{0, -3, 1}}, {{{2, 0, 1}, {1, 0, 0}, {0.25, 0.25}}});
}

TEST(TextureCoordinates, OfAConeRunFromBaseToApex) {
  // Axis z: base at 0, apex at 2; slope one half.
  expect_at(Cone{{0, 0, 2}, {0, 0, 0}, 1, 0, true, {}}, {{{0.5, 0, 1}, {2, 0, 1}, {0, 0.5}},
                                                         {{0, 0.25, 1.5}, {0, 2, 1}, {0.25, 0.75}},
                                                         {{0.5, 0, 0}, {0, 0, -1}, {0.75, 0.5}}});
  // Truncated, the wider end on top.
  expect_at(Cone{{0, 0, 2}, {0, 0, 0}, 1, 2, true, {}}, {{{1.5, 0, 1}, {2, 0, -1}, {0, 0.5}},
                                                         {{1, 0, 2}, {0, 0, 1}, {0.75, 0.5}},
                                                         {{0.5, 0, 0}, {0, 0, -1}, {0.75, 0.5}}});
}

TEST(TextureCoordinates, OfABoxRunRightAndUpOnEachFaceFromOutside) {
  expect_at(Box{{0, 0, 0}, {4, 8, 16}}, {{{4, 2, 4}, {1, 0, 0}, {0.75, 0.25}},
                                         {{0, 2, 4}, {-1, 0, 0}, {0.25, 0.25}},
                                         {{1, 2, 16}, {0, 0, 1}, {0.25, 0.25}},
                                         {{1, 2, 0}, {0, 0, -1}, {0.75, 0.25}},
                                         {{1, 8, 4}, {0, 1, 0}, {0.25, 0.75}},
                                         {{1, 0, 4}, {0, -1, 0}, {0.25, 0.25}}});
}

TEST(TextureCoordinates, AreUnchangedByATransform) {
  Random random(3);
  for (std::uint32_t i = 0; i < effort::cases(6000); ++i) {
    const Shape shape = any_shape(random, i);
    const Transform transform = random_transform(random);
    const auto plain = compiled(checkered(shape)), moved = compiled(checkered(shape, transform));
    for (int ray = 0; ray < 20; ++ray) {
      const Vec3 origin = random.vector(4), direction = rounded(random.direction());
      const Look before = look(*plain, plain->frame.render_from_world(origin), direction);
      if (!before.found || std::fabs(dot(before.surface.geometric_normal, direction)) < 1e-3) continue;
      const Affine map = affine(transform);
      const Vec3 there = moved->frame.render_from_world(map.point(origin));
      const Look after = look(*moved, there, normalize(map.direction(direction)));
      ASSERT_TRUE(after.found);
      const double seam = std::fabs(after.surface.uv.x - before.surface.uv.x);
      EXPECT_LE(std::min(seam, 1 - seam), 1e-8) << "shape " << i % 6;
      EXPECT_NEAR(after.surface.uv.y, before.surface.uv.y, 1e-8) << "shape " << i % 6;
      EXPECT_EQ(after.surface.back, before.surface.back) << "outside stays outside";
    }
  }
}

}  // namespace
}  // namespace tracer
