// Surface points of packets are bit-identical to those of single hits.
#include <gtest/gtest.h>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/support/scenes.h"
#include "tests/unit/shapes/look.h"
#include "tracer/src/interaction/surface.h"

namespace tracer {
namespace {

using oracle::Random;

enum class Variety { mixed, spheres, flat_triangles, smooth_triangles, quadrics, planes };

/// Shapes of one kind, or of all, so that packets have lanes of different kinds.
Scene scene_of(Random& random, Variety variety) {
  Scene scene = scenes::empty(1);
  const MaterialId material = scenes::add(scene, scenes::matte({1, 1, 1}));
  const auto wanted = [&](Variety kind) { return variety == Variety::mixed || variety == kind; };
  for (int i = 0; i < 10; ++i) {
    if (wanted(Variety::spheres)) scenes::add(scene, Sphere{random.vector(1), random.in(0.03, 0.3)}, material);
    if (wanted(Variety::flat_triangles))
      scenes::add(scene, scenes::placed(scenes::icosphere(1), 0.3, random.vector(1)), material);
    if (wanted(Variety::smooth_triangles))
      scenes::add(scene, scenes::placed(scenes::icosphere(1, true), 0.3, random.vector(1)), material);
    if (wanted(Variety::quadrics)) {
      scenes::add(scene, Box{random.vector(0.1), {0.4, 0.4, 0.4}}, material);
      scenes::add(scene, Cylinder{random.vector(1), random.vector(1), 0.1, true, {}}, material);
      scenes::add(scene, Cylinder{random.vector(1), random.vector(1), 0.2, false, {}}, material);
      scenes::add(scene, Cone{random.vector(1), random.vector(1), 0.3, 0, true, {}}, material);
      scenes::add(scene, Disc{random.vector(1), random.vector(1), 0.3, 0, {}}, material);
      scenes::add(scene, Sphere{random.vector(1), random.in(0.03, 0.3)}, material);
      scene.objects.back().transform = Transform{{{{1, 0, 0, 0}, {0, -2, 0.5, 0}, {0, 0, 0.5, 0}}}};
    }
    if (wanted(Variety::planes)) scenes::add(scene, Plane{random.vector(1), random.vector(1), {}}, material);
  }
  return scene;
}

void expect_same(const ShapeHit& expected, const PointPacket& points, int i) {
  ASSERT_EQ(points.position[i], expected.point.position);
  ASSERT_EQ(points.error[i], expected.point.error);
  ASSERT_EQ(points.face[i], expected.geometric_normal);
  ASSERT_EQ(points.object[i], expected.object);
  if (points.smooth) {
    ASSERT_EQ(points.normal[i], expected.shading_normal);
    ASSERT_EQ(points.offset[i], expected.shadow_offset);
  } else {
    ASSERT_EQ(expected.shading_normal, expected.geometric_normal);
    ASSERT_EQ(expected.shadow_offset, Vec3{});
  }
}

TEST(PointPacket, IsBitIdenticalToSingleHitsOfEveryKindOfShape) {
  Random random(3);
  for (const auto variety : {Variety::mixed, Variety::spheres, Variety::flat_triangles, Variety::smooth_triangles,
                             Variety::quadrics, Variety::planes})
    for (std::uint64_t round = 0; round < effort::cases(10); ++round) {
      const auto scene = compiled(scene_of(random, variety));
      for (int packets = 0; packets < 40; ++packets) {
        RayHitPacket hits;
        ShapeHit expected[lanes];
        for (int i = 0; i < lanes;) {
          const Vec3 origin = random.vector(1), direction = rounded(random.direction());
          const Look at = look(*scene, origin, direction);
          if (!at.found) continue;
          hits.on_ray.set(i, origin + direction * at.hit.t);
          hits.u[i] = at.hit.u;
          hits.v[i] = at.hit.v;
          hits.primitive[i] = at.hit.primitive;
          expected[i] = shape_hit(scene->geometry(), at.hit, hits.on_ray[i]);
          ++i;
        }
        PointPacket points;
        compute_points(scene->geometry(), hits, points);
        for (int i = 0; i < lanes; ++i) expect_same(expected[i], points, i);
        if (HasFatalFailure()) return;
      }
    }
}

/// The squares of their normals underflow.
TEST(PointPacket, NormalizesTheNormalsOfTinyTriangles) {
  TriangleGeometry tiny;
  tiny.positions = {{0, 0, 0}, {1e-60, 0, 0}, {0, 1e-60, 0}};
  tiny.triangles = {{0, 1, 2}};
  GeometrySet set;
  set.triangles = {tiny, tiny};
  for (Vec3& position : set.triangles[1].positions) position = position * 1e60;
  RayHitPacket hits{};
  for (int i = 0; i < lanes; ++i) {
    hits.primitive[i] = {i % 2 == 0 ? 0u : 1u, 0};
    hits.u[i] = hits.v[i] = 0.25;
  }
  PointPacket points;
  compute_points(set, hits, points);
  for (int i = 0; i < lanes; ++i) EXPECT_EQ(points.face[i], (Vec3{0, 0, 1})) << i;
}

}  // namespace
}  // namespace tracer
