// Points of sixteen hits at once are, to the last bit, those of one after the other.
#include "tracer/src/shapes/point_packet.h"

#include <gtest/gtest.h>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/support/scenes.h"
#include "tests/unit/shapes/look.h"

namespace tracer {
namespace {

using oracle::Random;

struct Seen {
  std::vector<double> ox, oy, oz, dx, dy, dz, t, u, v;
  std::vector<PrimitiveRef> primitive;

  void add(const Vec3& origin, const Vec3& direction, const Hit& hit) {
    ox.push_back(origin.x);
    oy.push_back(origin.y);
    oz.push_back(origin.z);
    dx.push_back(direction.x);
    dy.push_back(direction.y);
    dz.push_back(direction.z);
    t.push_back(hit.t);
    u.push_back(hit.u);
    v.push_back(hit.v);
    primitive.push_back(hit.primitive);
  }
  [[nodiscard]] RaySpan rays() const {
    return {ox.data(), oy.data(), oz.data(), dx.data(), dy.data(), dz.data(), nullptr, nullptr, t.size()};
  }
  [[nodiscard]] HitSpan hits() { return {primitive.data(), t.data(), u.data(), v.data()}; }
};

/// Spheres, flat triangles, smooth ones and a box, one of each textured, so that no packet is of one kind.
Scene mixed(Random& random) {
  Scene scene = scenes::empty(1);
  scene.textures.push_back({CheckerTexture{}, {1, 1}, {0, 0}, ""});
  Material textured = scenes::matte({1, 1, 1});
  textured.color = TextureId{0};
  const MaterialId materials[] = {scenes::add(scene, textured), scenes::add(scene, scenes::matte({1, 1, 1}))};
  for (const MaterialId material : materials) {
    for (int i = 0; i < 20; ++i) scenes::add(scene, Sphere{random.vector(1), random.in(0.03, 0.3)}, material);
    scenes::add(scene, scenes::placed(scenes::icosphere(1), 0.3, random.vector(1)), material);
    scenes::add(scene, scenes::placed(scenes::icosphere(1, true), 0.3, random.vector(1)), material);
    scenes::add(scene, Box{random.vector(0.1), {0.4, 0.4, 0.4}}, material);
  }
  return scene;
}

TEST(PointPacket, HoldsTheSurfacesOfSpheresAndFlatTrianglesToTheLastBit) {
  Random random(3);
  std::uint64_t known = 0, unknown = 0;
  for (std::uint64_t round = 0; round < effort::cases(20); ++round) {
    const auto scene = compiled(mixed(random));
    Seen seen;
    std::vector<Surface> expected;
    while (expected.size() < 1003) {
      const Vec3 origin = random.vector(1), direction = rounded(random.direction());
      const Look at = look(*scene, origin, direction);
      if (!at.found && random.chance(0.9)) continue;
      seen.add(origin, direction, at.hit);
      expected.push_back(at.surface);
    }
    PointPacket packet;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      if (i % lanes == 0) meet_points(scene->geometry(), seen.rays(), seen.hits(), i, packet);
      if (!(packet.known[i % lanes] > 0)) {
        unknown += seen.primitive[i].hit() ? 1 : 0;
        continue;
      }
      ++known;
      Surface surface;
      surface_of(*scene, {seen.primitive[i], seen.t[i], seen.u[i], seen.v[i]}, packet.point(i % lanes),
                 packet.normal(i % lanes), {seen.dx[i], seen.dy[i], seen.dz[i]}, surface);
      ASSERT_EQ(surface.point.position, expected[i].point.position);
      ASSERT_EQ(surface.point.error, expected[i].point.error);
      ASSERT_EQ(surface.geometric_normal, expected[i].geometric_normal);
      ASSERT_EQ(surface.normal, expected[i].normal);
      ASSERT_EQ(surface.shadow_offset, expected[i].shadow_offset);
      ASSERT_EQ(surface.back, expected[i].back);
      ASSERT_EQ(surface.material, expected[i].material);
      ASSERT_EQ(surface.object, expected[i].object);
      ASSERT_EQ(surface.uv, expected[i].uv);
    }
  }
  EXPECT_GT(known, effort::cases(20) * 100);
  EXPECT_GT(unknown, effort::cases(20) * 10) << "smooth triangles and boxes";
}

/// Their normals need normalize()'s care.
TEST(PointPacket, LeavesATriangleWhoseEdgesMultiplyToNextToNothingToOthers) {
  TriangleGeometry tiny;
  tiny.positions = {{0, 0, 0}, {1e-60, 0, 0}, {0, 1e-60, 0}};
  tiny.triangles = {{0, 1, 2}};
  GeometrySet set;
  set.triangles = {tiny, tiny};
  for (Vec3& position : set.triangles[1].positions) position = position * 1e60;
  Seen seen;
  for (const std::uint32_t mesh : {0u, 1u, 0u, 1u, 0u, 1u}) seen.add({0, 0, 1}, {0, 0, -1}, {{mesh, 0}, 1, 0.25, 0.25});
  PointPacket packet;
  meet_points(set, seen.rays(), seen.hits(), 0, packet);
  EXPECT_EQ(packet.known[0], 0);
  EXPECT_EQ(packet.known[1], 1);
  EXPECT_EQ(packet.normal(1), (Vec3{0, 0, 1}));
}

}  // namespace
}  // namespace tracer
