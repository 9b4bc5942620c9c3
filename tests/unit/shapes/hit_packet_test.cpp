// Points of sixteen hits at once are, to the last bit, those of one after the other.
#include "tracer/src/interaction/hit_packet.h"

#include <gtest/gtest.h>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/support/scenes.h"
#include "tests/unit/shapes/look.h"

namespace tracer {
namespace {

using oracle::Random;

RayHitPacket met_by(const Look* looks, const Vec3* origins, const Vec3* directions) {
  RayHitPacket met;
  for (int i = 0; i < lanes; ++i) {
    const Vec3 on_ray = origins[i] + directions[i] * looks[i].hit.t;
    met.on_x[i] = on_ray.x;
    met.on_y[i] = on_ray.y;
    met.on_z[i] = on_ray.z;
    met.u[i] = looks[i].hit.u;
    met.v[i] = looks[i].hit.v;
    met.primitive[i] = looks[i].hit.primitive;
  }
  return met;
}

enum class Variety { mixed, balls, flat_triangles, smooth_triangles, quadrics, planes };

/// Of one kind, or of all, so that no packet is of one.
Scene scene_of(Random& random, Variety variety) {
  Scene scene = scenes::empty(1);
  const MaterialId material = scenes::add(scene, scenes::matte({1, 1, 1}));
  const auto wanted = [&](Variety kind) { return variety == Variety::mixed || variety == kind; };
  for (int i = 0; i < 10; ++i) {
    if (wanted(Variety::balls)) scenes::add(scene, Sphere{random.vector(1), random.in(0.03, 0.3)}, material);
    if (wanted(Variety::flat_triangles))
      scenes::add(scene, scenes::placed(scenes::icosphere(1), 0.3, random.vector(1)), material);
    if (wanted(Variety::smooth_triangles))
      scenes::add(scene, scenes::placed(scenes::icosphere(1, true), 0.3, random.vector(1)), material);
    if (wanted(Variety::quadrics)) {
      scenes::add(scene, Box{random.vector(0.1), {0.4, 0.4, 0.4}}, material);
      scenes::add(scene, Cylinder{.from = random.vector(1), .to = random.vector(1), .radius = 0.1, .u_axis = {}},
                  material);
      scenes::add(
          scene, Cylinder{.from = random.vector(1), .to = random.vector(1), .radius = 0.2, .caps = false, .u_axis = {}},
          material);
      scenes::add(scene, Cone{.apex = random.vector(1), .base = random.vector(1), .radius = 0.3, .u_axis = {}},
                  material);
      scenes::add(scene, Disc{.center = random.vector(1), .normal = random.vector(1), .radius = 0.3, .u_axis = {}},
                  material);
      scenes::add(scene, Sphere{random.vector(1), random.in(0.03, 0.3)}, material);
      scene.objects.back().transform = Transform{{{{1, 0, 0, 0}, {0, -2, 0.5, 0}, {0, 0, 0.5, 0}}}};
    }
    if (wanted(Variety::planes))
      scenes::add(scene, Plane{.point = random.vector(1), .normal = random.vector(1), .u_axis = {}}, material);
  }
  return scene;
}

void expect_same(const ShapeHit& expected, const PointPacket& points, int i) {
  const auto at = [i](const double* x, const double* y, const double* z) { return Vec3{x[i], y[i], z[i]}; };
  ASSERT_EQ(at(points.x, points.y, points.z), expected.point.position);
  ASSERT_EQ(at(points.error_x, points.error_y, points.error_z), expected.point.error);
  ASSERT_EQ(at(points.face_x, points.face_y, points.face_z), expected.geometric_normal);
  ASSERT_EQ(points.object[i], expected.object);
  if (points.smooth) {
    ASSERT_EQ(at(points.normal_x, points.normal_y, points.normal_z), expected.shading_normal);
    ASSERT_EQ(at(points.offset_x, points.offset_y, points.offset_z), expected.shadow_offset);
  } else {
    ASSERT_EQ(expected.shading_normal, expected.geometric_normal);
    ASSERT_EQ(expected.shadow_offset, Vec3{});
  }
}

TEST(PointPacket, HoldsTheHitsOfEveryKindOfShapeToTheLastBit) {
  Random random(3);
  for (const auto variety : {Variety::mixed, Variety::balls, Variety::flat_triangles, Variety::smooth_triangles,
                             Variety::quadrics, Variety::planes})
    for (std::uint64_t round = 0; round < effort::cases(10); ++round) {
      const auto scene = compiled(scene_of(random, variety));
      for (int packets = 0; packets < 40; ++packets) {
        Look looks[lanes];
        Vec3 origins[lanes], directions[lanes];
        for (int i = 0; i < lanes; ++i) {
          do {
            origins[i] = random.vector(1);
            directions[i] = rounded(random.direction());
            looks[i] = look(*scene, origins[i], directions[i]);
          } while (!looks[i].found);
        }
        const RayHitPacket met = met_by(looks, origins, directions);
        PointPacket points;
        compute_points(scene->geometry(), met, points);
        for (int i = 0; i < lanes; ++i) {
          const ShapeHit expected = shape_hit(scene->geometry(), looks[i].hit, {met.on_x[i], met.on_y[i], met.on_z[i]});
          expect_same(expected, points, i);
          if (HasFatalFailure()) return;
        }
      }
    }
}

/// Their normals need normalize()'s care.
TEST(PointPacket, TakesCareOfTrianglesWhoseEdgesMultiplyToNextToNothing) {
  TriangleGeometry tiny;
  tiny.positions = {{0, 0, 0}, {1e-60, 0, 0}, {0, 1e-60, 0}};
  tiny.triangles = {{0, 1, 2}};
  GeometrySet set;
  set.triangles = {tiny, tiny};
  for (Vec3& position : set.triangles[1].positions) position = position * 1e60;
  RayHitPacket met{};
  for (int i = 0; i < lanes; ++i) {
    met.primitive[i] = {i % 2 == 0 ? 0u : 1u, 0};
    met.u[i] = met.v[i] = 0.25;
  }
  PointPacket points;
  compute_points(set, met, points);
  for (int i = 0; i < lanes; ++i) {
    EXPECT_EQ(points.face_x[i], 0) << i;
    EXPECT_EQ(points.face_y[i], 0) << i;
    EXPECT_EQ(points.face_z[i], 1) << i;
  }
}

}  // namespace
}  // namespace tracer
