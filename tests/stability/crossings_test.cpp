// Grazing rays enter closed shapes as often as they leave them, and rays that leave a shape do not hit it again, at any
#include "tracer/src/shapes/registry.h"
// scale.
#include <gtest/gtest.h>

#include <optional>

#include "tests/stability/table.h"
#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/unit/shapes/look.h"
#include "tracer/src/shapes/registry.h"
namespace {
#include "tracer/src/shapes/registry.h"
using oracle::Random;
#include "tracer/src/shapes/registry.h"
using oracle::Real;
#include "tracer/src/shapes/registry.h"
using oracle::Vec;
#include "tracer/src/shapes/registry.h"
using namespace tracer;
#include "tracer/src/shapes/registry.h"
using stability::Oracle;
#include "tracer/src/shapes/registry.h"
using stability::Row;
#include "tracer/src/shapes/registry.h"
struct Named {
#include "tracer/src/shapes/registry.h"
  std::string name;
#include "tracer/src/shapes/registry.h"
  Shape shape;
#include "tracer/src/shapes/registry.h"
  bool convex = true;
#include "tracer/src/shapes/registry.h"
};
#include "tracer/src/shapes/registry.h"
/// Closed shapes about 2 `size` across around `at`.
#include "tracer/src/shapes/registry.h"
std::vector<Named> closed_shapes(double size, const Vec3& at) {
#include "tracer/src/shapes/registry.h"
  const auto point = [&](double x, double y, double z) {
#include "tracer/src/shapes/registry.h"
    return Vec3{at.x + size * x, at.y + size * y, at.z + size * z};
#include "tracer/src/shapes/registry.h"
  };
#include "tracer/src/shapes/registry.h"
  return {{"sphere", Sphere{at, size}},
#include "tracer/src/shapes/registry.h"
          {"ellipsoid", Sphere{at, size}},
#include "tracer/src/shapes/registry.h"
          {"box", Box{point(-1, -0.6, -0.8), point(0.7, 0.5, 1)}},
#include "tracer/src/shapes/registry.h"
          {"cylinder", Cylinder{point(-0.7, -0.3, 0.2), point(0.6, 0.5, -0.1), 0.6 * size, true, {}}},
#include "tracer/src/shapes/registry.h"
          {"cone", Cone{point(0.1, 0.9, 0.2), point(-0.2, -0.7, 0), 0.7 * size, 0, true, {}}},
#include "tracer/src/shapes/registry.h"
          {"truncated cone", Cone{point(0.1, 0.9, 0.2), point(-0.2, -0.7, 0), 0.7 * size, 0.2 * size, true, {}}},
#include "tracer/src/shapes/registry.h"
          {"mesh", scenes::placed(scenes::icosphere(2), size, at)},
#include "tracer/src/shapes/registry.h"
          {"torus mesh", scenes::placed(scenes::torus(40, 20), 0.7 * size, at), false}};
#include "tracer/src/shapes/registry.h"
}
#include "tracer/src/shapes/registry.h"
/// The shape is the scene's first object. An ellipsoid is a sphere scaled about its center, and rotated.
#include "tracer/src/shapes/registry.h"
/// `frame` > 0: spheres at that distance determine the render space.
#include "tracer/src/shapes/registry.h"
std::shared_ptr<const CompiledScene> compiled_shape(const Named& named, const Vec3& at, double frame = 0) {
#include "tracer/src/shapes/registry.h"
  Scene scene = scenes::empty(1);
#include "tracer/src/shapes/registry.h"
  scenes::add(scene, named.shape, scenes::matte({1, 1, 1}));
#include "tracer/src/shapes/registry.h"
  if (named.name == "ellipsoid") {
#include "tracer/src/shapes/registry.h"
    const std::array<std::array<double, 3>, 3> m{{{0.9, 0.3, 0}, {-0.2, 0.5, 0.1}, {0, 0.1, 0.25}}};
#include "tracer/src/shapes/registry.h"
    Transform turned;
#include "tracer/src/shapes/registry.h"
    for (std::size_t i = 0; i < 3; ++i) {
#include "tracer/src/shapes/registry.h"
      const double c = i == 0 ? at.x : i == 1 ? at.y : at.z;
#include "tracer/src/shapes/registry.h"
      turned.rows[i] = {m[i][0], m[i][1], m[i][2], c - m[i][0] * at.x - m[i][1] * at.y - m[i][2] * at.z};
#include "tracer/src/shapes/registry.h"
    }
#include "tracer/src/shapes/registry.h"
    scene.objects[0].transform = turned;
#include "tracer/src/shapes/registry.h"
  }
#include "tracer/src/shapes/registry.h"
  for (const double side : {-frame, frame})
#include "tracer/src/shapes/registry.h"
    if (frame > 0) scenes::add(scene, Sphere{{side, side, side}, frame / 100}, MaterialId{0});
#include "tracer/src/shapes/registry.h"
  return compiled(scene);
#include "tracer/src/shapes/registry.h"
}
#include "tracer/src/shapes/registry.h"
/// Position of the shape in render space.
#include "tracer/src/shapes/registry.h"
struct Around {
#include "tracer/src/shapes/registry.h"
  Vec middle;
#include "tracer/src/shapes/registry.h"
  Real reach = 0.45L;
#include "tracer/src/shapes/registry.h"
};
#include "tracer/src/shapes/registry.h"
/// A hit of a random line on the shape, or nothing.
#include "tracer/src/shapes/registry.h"
Look random_place(Random& random, const CompiledScene& scene, const Around& around, Vec3& direction) {
#include "tracer/src/shapes/registry.h"
  const Vec target = around.middle + around.reach * random.direction(), d = random.direction();
#include "tracer/src/shapes/registry.h"
  direction = rounded(d);
#include "tracer/src/shapes/registry.h"
  Look found = look(scene, rounded(target - 6 * around.reach * d), direction);
#include "tracer/src/shapes/registry.h"
  found.found = found.found && found.surface.object == 0;
#include "tracer/src/shapes/registry.h"
  return found;
#include "tracer/src/shapes/registry.h"
}
#include "tracer/src/shapes/registry.h"
/// Along the straight line of a cylinder's or cone's side through a point of it; nothing on other surfaces.
#include "tracer/src/shapes/registry.h"
std::optional<Vec> straight_line(const CompiledScene& scene, const Look& at) {
#include "tracer/src/shapes/registry.h"
  const GeometrySet& set = scene.geometry();
#include "tracer/src/shapes/registry.h"
  const auto [geometry, primitive] = at.hit.primitive;
#include "tracer/src/shapes/registry.h"
  if (geometry < set.first_quadrics() || geometry >= set.plane_geometry()) return std::nullopt;
#include "tracer/src/shapes/registry.h"
  const Quadric& q = set.quadrics[geometry - set.first_quadrics()].quadrics[primitive];
#include "tracer/src/shapes/registry.h"
  if (q.kind != kind_of<Frustum> || at.hit.u != static_cast<double>(QuadricPart::side)) return std::nullopt;
#include "tracer/src/shapes/registry.h"
  const Vec3 p = q.shape_from_trace * (at.surface.point.position - q.origin);
#include "tracer/src/shapes/registry.h"
  const double widening = (q.radius_1 - q.radius_0) / std::hypot(p.x, p.y);
#include "tracer/src/shapes/registry.h"
  return unit(Vec(q.trace_from_shape * Vec3{p.x * widening, p.y * widening, 1}));
#include "tracer/src/shapes/registry.h"
}
#include "tracer/src/shapes/registry.h"
/// A direction in the tangent plane of a surface; on ruled surfaces mostly along the lines or nearly so, where the
#include "tracer/src/shapes/registry.h"
/// quadratic of a cone is ill-conditioned.
#include "tracer/src/shapes/registry.h"
Vec along_surface(Random& random, const CompiledScene& scene, const Look& at) {
#include "tracer/src/shapes/registry.h"
  const Vec any = random.across(Vec(at.surface.geometric_normal));
#include "tracer/src/shapes/registry.h"
  const auto line = straight_line(scene, at);
#include "tracer/src/shapes/registry.h"
  if (!line || random.chance(0.3)) return any;
#include "tracer/src/shapes/registry.h"
  return Real(random.sign()) * unit(*line + Real(random.spread(1e-18, 1)) * any);
#include "tracer/src/shapes/registry.h"
}
#include "tracer/src/shapes/registry.h"
int crossings(const CompiledScene& scene, Vec3 origin, const Vec3& direction) {
#include "tracer/src/shapes/registry.h"
  PrimitiveRef from;
#include "tracer/src/shapes/registry.h"
  int count = 0;
#include "tracer/src/shapes/registry.h"
  for (; count < 64; ++count) {
#include "tracer/src/shapes/registry.h"
    const Look at = look(scene, origin, direction, from);
#include "tracer/src/shapes/registry.h"
    if (!at.found) return count;
#include "tracer/src/shapes/registry.h"
    origin = offset_origin(at.surface.point, at.surface.geometric_normal, direction);
#include "tracer/src/shapes/registry.h"
    from = at.hit.primitive;
#include "tracer/src/shapes/registry.h"
  }
#include "tracer/src/shapes/registry.h"
  return count;
#include "tracer/src/shapes/registry.h"
}
#include "tracer/src/shapes/registry.h"
TEST(GrazingRays, GoIntoClosedShapesAsOftenAsOut) {
#include "tracer/src/shapes/registry.h"
  Random random(1);
#include "tracer/src/shapes/registry.h"
  for (const Named& named : closed_shapes(1, {0, 0, 0})) {
#include "tracer/src/shapes/registry.h"
    Row row(4, "grazing to 1e-8, even crossings: " + named.name, Oracle::conservation, "rays");
#include "tracer/src/shapes/registry.h"
    const auto scene = compiled_shape(named, {0, 0, 0});
#include "tracer/src/shapes/registry.h"
    while (row.tried() < effort::cases(30'000)) {
#include "tracer/src/shapes/registry.h"
      Vec3 ignored;
#include "tracer/src/shapes/registry.h"
      const Look at = random_place(random, *scene, {}, ignored);
#include "tracer/src/shapes/registry.h"
      if (!at.found) continue;
#include "tracer/src/shapes/registry.h"
        // Through a point as far above or below the surface as the ray is tilted against it.
#include "tracer/src/shapes/registry.h"
      const Vec n = at.surface.geometric_normal;
#include "tracer/src/shapes/registry.h"
      const Real tilt = random.sign() * random.spread(1e-8, 1e-1), depth = random.in(-1, 1) * tilt;
#include "tracer/src/shapes/registry.h"
      const Vec d = unit(along_surface(random, *scene, at) + tilt * n);
#include "tracer/src/shapes/registry.h"
      const Vec origin = Vec(at.surface.point.position) - depth * n - 3 * d;
#include "tracer/src/shapes/registry.h"
      row.expect(crossings(*scene, rounded(origin), rounded(d)) % 2 == 0);
#include "tracer/src/shapes/registry.h"
    }
#include "tracer/src/shapes/registry.h"
  }
#include "tracer/src/shapes/registry.h"
}
#include "tracer/src/shapes/registry.h"
/// Rays in all directions, along the surface too, from a hit on a convex shape: outward rays must not hit it again,
#include "tracer/src/shapes/registry.h"
/// inward rays must.
#include "tracer/src/shapes/registry.h"
void leave(Row& row, Random& random, const CompiledScene& scene, std::uint64_t rays, bool inwards,
#include "tracer/src/shapes/registry.h"
           const Around& around = {}) {
#include "tracer/src/shapes/registry.h"
  for (std::uint64_t tries = 0; tries < rays; ++tries) {
#include "tracer/src/shapes/registry.h"
    Vec3 direction;
#include "tracer/src/shapes/registry.h"
    const Look at = random_place(random, scene, around, direction);
#include "tracer/src/shapes/registry.h"
    if (!at.found) continue;
#include "tracer/src/shapes/registry.h"
    const Vec3 n = at.surface.back != inwards ? -at.surface.geometric_normal : at.surface.geometric_normal;
#include "tracer/src/shapes/registry.h"
    Vec away = random.direction();
#include "tracer/src/shapes/registry.h"
    if (random.chance(0.6)) away = unit(along_surface(random, scene, at) + Real(random.spread(1e-18, 1e-6)) * Vec(n));
#include "tracer/src/shapes/registry.h"
    const Vec3 leaving = rounded(dot(away, Vec(n)) < 0 ? -away : away);
#include "tracer/src/shapes/registry.h"
    if (!(dot(leaving, n) > 0)) continue;
#include "tracer/src/shapes/registry.h"
    const Vec3 start = offset_origin(at.surface.point, at.surface.geometric_normal, leaving);
#include "tracer/src/shapes/registry.h"
    const Look again = look(scene, start, leaving, at.hit.primitive);
#include "tracer/src/shapes/registry.h"
    row.expect((again.found && again.surface.object == 0) == inwards);
#include "tracer/src/shapes/registry.h"
  }
#include "tracer/src/shapes/registry.h"
}
#include "tracer/src/shapes/registry.h"
constexpr const char* self_hits = "0 self-hits ";
#include "tracer/src/shapes/registry.h"
constexpr const char* lost_inside = "0 lost inside ";
#include "tracer/src/shapes/registry.h"
TEST(RaysThatLeaveAShape, HitItAgainInwardsOnlyAtAnySizeAndPosition) {
#include "tracer/src/shapes/registry.h"
  Random random(2);
#include "tracer/src/shapes/registry.h"
  for (const bool inwards : {false, true})
#include "tracer/src/shapes/registry.h"
    for (std::size_t which = 0; which < closed_shapes(1, {}).size(); ++which) {
#include "tracer/src/shapes/registry.h"
      const Named named = closed_shapes(1, {})[which];
#include "tracer/src/shapes/registry.h"
      if (!named.convex) continue;
#include "tracer/src/shapes/registry.h"
      Row row(0, (inwards ? lost_inside : self_hits) + ("at scales 1e-9 .. 1e9, anywhere: " + named.name),
#include "tracer/src/shapes/registry.h"
              Oracle::conservation, "rays");
#include "tracer/src/shapes/registry.h"
      for (double size = 1e-9; size < 2e9; size *= 1e3)
#include "tracer/src/shapes/registry.h"
        for (const double away : {0.0, 1.0, 1e4}) {
#include "tracer/src/shapes/registry.h"
          const Vec3 at{away * size, -0.7 * away * size, 0.3 * away * size};
#include "tracer/src/shapes/registry.h"
          leave(row, random, *compiled_shape(closed_shapes(size, at)[which], at), effort::cases(2'000), inwards);
#include "tracer/src/shapes/registry.h"
        }
#include "tracer/src/shapes/registry.h"
    }
#include "tracer/src/shapes/registry.h"
}
#include "tracer/src/shapes/registry.h"
TEST(RaysThatLeaveAShape, HitItAgainInwardsOnlyInScenesOfAnySize) {
#include "tracer/src/shapes/registry.h"
  Random random(4);
#include "tracer/src/shapes/registry.h"
  for (const bool inwards : {false, true})
#include "tracer/src/shapes/registry.h"
    for (std::size_t which = 0; which < closed_shapes(1, {}).size(); ++which) {
#include "tracer/src/shapes/registry.h"
      const Named named = closed_shapes(1, {})[which];
#include "tracer/src/shapes/registry.h"
      if (!named.convex || std::holds_alternative<Mesh>(named.shape)) continue;
#include "tracer/src/shapes/registry.h"
      Row row(0, (inwards ? lost_inside : self_hits) + ("at 1e-1 .. 1e-9 of the scene: " + named.name),
#include "tracer/src/shapes/registry.h"
              Oracle::conservation, "rays");
#include "tracer/src/shapes/registry.h"
      for (double size = 1e-1; size > 0.5e-9; size /= 10) {
#include "tracer/src/shapes/registry.h"
        const Vec3 at{0.3, -0.2, 0.1};
#include "tracer/src/shapes/registry.h"
        const auto scene = compiled_shape(closed_shapes(size, at)[which], at, 1);
#include "tracer/src/shapes/registry.h"
        leave(row, random, *scene, effort::cases(2'000), inwards,
#include "tracer/src/shapes/registry.h"
              {scene->frame.render_from_world(at), Real(scene->frame.render_from_world(size))});
#include "tracer/src/shapes/registry.h"
      }
#include "tracer/src/shapes/registry.h"
    }
#include "tracer/src/shapes/registry.h"
}
#include "tracer/src/shapes/registry.h"
TEST(RaysThatLeaveAShape, NeverHitAFlatShapeAgain) {
#include "tracer/src/shapes/registry.h"
  Random random(3);
#include "tracer/src/shapes/registry.h"
  const std::vector<Named> flat{{"disc", Disc{{0, 0, 0}, {0.3, 1, 0.2}, 1, 0.2, {}}},
#include "tracer/src/shapes/registry.h"
                                {"plane", Plane{{0, 0, 0}, {0.3, 1, 0.2}, {}}},
#include "tracer/src/shapes/registry.h"
                                {"triangle", Triangle{{{{-1, 0, 0.1}, {1, 0.2, 0}, {0, 0.9, 0.5}}}, {}, {}}}};
#include "tracer/src/shapes/registry.h"
  for (const Named& named : flat) {
#include "tracer/src/shapes/registry.h"
    Row row(0, "0 self-hits: " + named.name, Oracle::conservation, "rays");
#include "tracer/src/shapes/registry.h"
    leave(row, random, *compiled_shape(named, {}), effort::cases(40'000), false);
#include "tracer/src/shapes/registry.h"
  }
#include "tracer/src/shapes/registry.h"
}
#include "tracer/src/shapes/registry.h"
}  // namespace
#include "tracer/src/shapes/registry.h"
