// What shading is told of triangles and meshes: the point within its error, normals, sides, texture coordinates.
#include <gtest/gtest.h>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/unit/shapes/look.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;

TEST(TriangleSurface, PointIsWithinItsErrorOfTheTriangleAndInterpolatesNormalsAndCoordinates) {
  Random random(5);
  std::uint64_t hits = 0;
  for (std::uint64_t i = 0; i < effort::cases(3000); ++i) {
    Triangle triangle{{{random.vector(1), random.vector(1), random.vector(1)}}, {}, {}};
    const std::array<Vec3, 3> normals{rounded(random.direction()), rounded(random.direction()),
                                      rounded(random.direction())};
    triangle.normals = normals;
    triangle.uvs = std::array<Vec2, 3>{Vec2{random.in(-5, 5), 0}, Vec2{0, random.in(-5, 5)}, Vec2{1e6, 1}};
    const auto c = compiled(checkered(triangle));
    const TriangleGeometry& g = c->geometry.triangles[0];
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
      ASSERT_LE(std::fabs(dot(n, p - a)), box_reach(at.surface, n));
      ASSERT_LE(length(Vec(at.surface.geometric_normal) - n), 1e-12L);
      const bool back = dot(target - origin, n) > 0;
      ASSERT_EQ(at.surface.back, back);
      // The point told is where the barycentric coordinates are; near the line of sight, within their conditioning.
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
  EXPECT_GT(hits, effort::cases(3000) * 10);
}

TEST(MeshSurface, SmoothNormalsAreWeightedByTheAreaOfTheFacesAround) {
  // A corner where a large and a small face meet at a right angle.
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 0, -1}, {0, 0, 1}, {-3, 0, 0}, {0, 2, 0}, {0, 0, 2}};
  mesh.triangles = {{0, 1, 2}, {0, 6, 5}};  // twice the areas: 1 up, 4 along -x
  mesh.smooth = true;
  const auto c = compiled(checkered(mesh));
  const auto& normal = c->geometry.triangles[0].normals[0];
  const Vec expected = unit(Vec(cross(Vec(1, 0, 0), Vec(0, 0, -1)) + cross(Vec(0, 0, 2), Vec(0, 2, 0))));
  EXPECT_NEAR(normal[0], static_cast<double>(expected.x), 1e-7);
  EXPECT_NEAR(normal[1], static_cast<double>(expected.y), 1e-7);
  EXPECT_NEAR(normal[2], static_cast<double>(expected.z), 1e-7);
  // A position that no face uses, and one whose faces cancel, fall back to the face's normal: zero means that.
  EXPECT_EQ(c->geometry.triangles[0].normals[3], (std::array<float, 3>{0, 0, 0}));
}

TEST(MeshSurface, SmoothNormalsOfAnIcosphereAreRadial) {
  const auto c = compiled(checkered(scenes::icosphere(3, true)));
  const TriangleGeometry& g = c->geometry.triangles[0];
  const Mesh mesh = scenes::icosphere(3, true);
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const Vec n(g.normals[i][0], g.normals[i][1], g.normals[i][2]);
    ASSERT_GT(dot(n, mesh.positions[i]), 0.999L);
  }
}

TEST(MeshSurface, WithoutNormalsIsFlatAndWithoutCoordinatesBarycentric) {
  const auto c = compiled(checkered(scenes::icosphere(1)));
  const Look at = look(*c, c->frame.trace_from_world(Vec3{0.1, 0.2, 3}), {0, 0, -1});
  ASSERT_TRUE(at.found);
  EXPECT_EQ(at.surface.normal, at.surface.geometric_normal);
  EXPECT_EQ(at.surface.uv, (Vec2{at.hit.u, at.hit.v}));
}

}  // namespace
}  // namespace tracer
