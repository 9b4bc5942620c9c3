// Lines alternately enter and leave closed shapes, also if they graze them or pass close to an edge; rays that leave a
// shape do not hit it again, at any scale; and nothing passes through closed meshes.
#include <gtest/gtest.h>

#include <optional>

#include "tests/stability/table.h"
#include "tests/support/effort.h"
#include "tests/support/leaks.h"
#include "tests/support/random.h"
#include "tests/unit/shapes/look.h"
#include "tracer/src/shapes/shape_registry.h"

namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;
using namespace tracer;
using stability::Oracle;
using stability::Row;

struct Named {
  std::string name;
  Shape shape;
  bool convex = true;
};

/// Closed shapes about 2 `size` across around `at`.
std::vector<Named> closed_shapes(double size, const Vec3& at) {
  const auto point = [&](double x, double y, double z) {
    return Vec3{at.x + size * x, at.y + size * y, at.z + size * z};
  };
  return {{"sphere", Sphere{at, size}},
          {"ellipsoid", Sphere{at, size}},
          {"box", Box{point(-1, -0.6, -0.8), point(0.7, 0.5, 1)}},
          {"cylinder", Cylinder{point(-0.7, -0.3, 0.2), point(0.6, 0.5, -0.1), 0.6 * size, true, {}}},
          {"cone", Cone{point(0.1, 0.9, 0.2), point(-0.2, -0.7, 0), 0.7 * size, 0, true, {}}},
          {"truncated cone", Cone{point(0.1, 0.9, 0.2), point(-0.2, -0.7, 0), 0.7 * size, 0.2 * size, true, {}}},
          {"mesh", scenes::placed(scenes::icosphere(2), size, at)},
          {"torus", Torus{at, {0.5, 1, 0.4}, 0.7 * size, 0.25 * size, {}}, false},
          {"torus mesh", scenes::placed(scenes::torus(40, 20), 0.7 * size, at), false}};
}

/// The shape is the scene's first object. An ellipsoid is a sphere scaled about its center, and rotated.
/// `frame` > 0: spheres at that distance determine the render space.
std::shared_ptr<const CompiledScene> compiled_shape(const Named& named, const Vec3& at, double frame = 0) {
  Scene scene = scenes::empty(1);
  scenes::add(scene, named.shape, scenes::matte({1, 1, 1}));
  if (named.name == "ellipsoid") {
    const std::array<std::array<double, 3>, 3> m{{{0.9, 0.3, 0}, {-0.2, 0.5, 0.1}, {0, 0.1, 0.25}}};
    Transform turned;
    for (std::size_t i = 0; i < 3; ++i) {
      const double c = i == 0 ? at.x : i == 1 ? at.y : at.z;
      turned.rows[i] = {m[i][0], m[i][1], m[i][2], c - m[i][0] * at.x - m[i][1] * at.y - m[i][2] * at.z};
    }
    scene.objects[0].transform = turned;
  }
  for (const double side : {-frame, frame})
    if (frame > 0) scenes::add(scene, Sphere{{side, side, side}, frame / 100}, MaterialId{0});
  return compiled(scene);
}

/// Position of the shape in render space.
struct Around {
  Vec middle;
  Real reach = 0.45L;
};

/// A hit of a random line on the shape, or nothing.
Look random_place(Random& random, const CompiledScene& scene, const Around& around, Vec3& direction) {
  const Vec target = around.middle + around.reach * random.direction(), d = random.direction();
  direction = rounded(d);
  Look found = look(scene, rounded(target - 6 * around.reach * d), direction);
  found.found = found.found && found.surface.object == 0;
  return found;
}

/// Along the straight line of a cylinder's or cone's side through a point of it; nothing on other surfaces.
std::optional<Vec> straight_line(const CompiledScene& scene, const Look& at) {
  const GeometrySet& set = scene.geometry();
  const auto [geometry, primitive] = at.hit.primitive;
  if (geometry < set.first_quadrics() || geometry >= set.plane_geometry()) return std::nullopt;
  const Quadric& q = set.quadrics[geometry - set.first_quadrics()].quadrics[primitive];
  if (q.kind != kind_of<Frustum> || at.hit.u != static_cast<double>(QuadricPart::side)) return std::nullopt;
  const Vec3 p = q.shape_from_render * (at.surface.point.position - q.origin);
  const double widening = (q.radius_1 - q.radius_0) / std::hypot(p.x, p.y);
  return unit(Vec(q.render_from_shape * Vec3{p.x * widening, p.y * widening, 1}));
}

/// A direction in the tangent plane of a surface; on ruled surfaces mostly along the lines or nearly so, where the
/// quadratic of a cone is ill-conditioned.
Vec along_surface(Random& random, const CompiledScene& scene, const Look& at) {
  const Vec any = random.across(Vec(at.surface.geometric_normal));
  const auto line = straight_line(scene, at);
  if (!line || random.chance(0.3)) return any;
  return Real(random.sign()) * unit(*line + Real(random.spread(1e-18, 1)) * any);
}

/// Number of surfaces that a line crosses with the integrator's ray offsets. Nothing unless it alternately enters and
/// leaves the solid and ends outside.
std::optional<int> crossings(const CompiledScene& scene, Vec3 origin, const Vec3& direction) {
  PrimitiveRef from;
  for (int count = 0; count < 64; ++count) {
    const Look at = look(scene, origin, direction, from);
    const bool inside = count % 2 == 1;
    if (!at.found) return inside ? std::nullopt : std::optional(count);
    if (at.surface.back != inside) return std::nullopt;
    origin = offset_origin(at.surface.point, at.surface.geometric_normal, direction);
    from = at.hit.primitive;
  }
  return std::nullopt;
}

TEST(GrazingRays, EnterClosedShapesAsOftenAsTheyLeave) {
  Random random(1);
  for (const Named& named : closed_shapes(1, {0, 0, 0})) {
    Row row(4, "grazing to 1e-8, even crossings: " + named.name, Oracle::conservation, "rays");
    const auto scene = compiled_shape(named, {0, 0, 0});
    while (row.tried() < effort::cases(30'000)) {
      Vec3 ignored;
      const Look at = random_place(random, *scene, {}, ignored);
      if (!at.found) continue;
      // Through a point as far above or below the surface as the ray is tilted against it.
      const Vec n = at.surface.geometric_normal;
      const Real tilt = random.sign() * random.spread(1e-8, 1e-1), depth = random.in(-1, 1) * tilt;
      const Vec d = unit(along_surface(random, *scene, at) + tilt * n);
      const Vec origin = Vec(at.surface.point.position) - depth * n - 3 * d;
      row.expect(crossings(*scene, rounded(origin), rounded(d)).has_value());
    }
  }
}

/// A point where a surface is not smooth, and the edge's direction there (zero: none, or any).
struct Sharp {
  Vec point, along;
};

/// Points of two circles around the z axis.
std::vector<Sharp> circles(Real radius_0, Real z_0, Real radius_1, Real z_1) {
  std::vector<Sharp> points;
  for (int i = 0; i < 1000; ++i)
    for (const auto& [radius, z] : {std::pair{radius_0, z_0}, {radius_1, z_1}}) {
      const Real x = std::cos(0.0063L * i), y = std::sin(0.0063L * i);
      points.push_back({{radius * x, radius * y, z}, {-y, x, 0}});
    }
  return points;
}

std::vector<Sharp> corners_of(const Mesh& mesh) {
  std::vector<Sharp> corners;
  for (const Vec3& position : mesh.positions) corners.push_back({position, {}});
  return corners;
}

/// Least distance of a line to an edge, relative to the distance of its origin. Sides and caps overlap by 2^-46
/// (quadric.h) and rays start outside of that overlap: thinner parts may be entered and not left.
constexpr Real closest_pass = 0x1p-42L;

void pass_edges(const std::string& name, const Shape& shape, const std::vector<Sharp>& sharp) {
  Row row(9, "past apexes, rims, edges by 2^-42 and more: " + name, Oracle::conservation, "rays");
  Random random(1);
  Scene scene = scenes::empty(1);
  scenes::add(scene, shape, scenes::matte({1, 1, 1}));
  const auto made = compiled(scene);
  std::uint64_t crossed = 0;
  for (std::uint64_t i = 0; i < effort::cases(100'000); ++i) {
    const Real distance = random.spread(2, random.chance(0.2) ? 1e6 : 10);
    const Real beside = random.spread(static_cast<double>(closest_pass * distance), 1e-1);
    const Sharp& edge = sharp[random.below(static_cast<std::uint32_t>(sharp.size()))];
    const Vec direction = random.direction();
    const bool smooth = !(length(edge.along) > 0);
    const Vec aside = smooth ? random.across(direction) : Real(random.sign()) * unit(cross(direction, edge.along));
    const Vec3 origin = made->frame.render_from_world(rounded(edge.point + beside * aside - distance * direction));
    const auto found = crossings(*made, origin, rounded(direction));
    row.expect(found.has_value());
    crossed += static_cast<std::uint64_t>(found.value_or(0));
  }
  EXPECT_GT(crossed, row.tried() / 2) << name;
}

TEST(LinesPastEdges, EnterClosedShapesAsOftenAsTheyLeave) {
  const auto cone = [](double height, double radius, double apex_radius) {
    return Cone{{0, 0, height}, {0, 0, 0}, radius, apex_radius, true, {}};
  };
  pass_edges("cone", cone(1, 0.5, 0), circles(0, 1, 0.5L, 0));
  pass_edges("steep cone", cone(1, 0.01, 0), circles(0, 1, 0.01L, 0));
  pass_edges("flat cone", cone(0.1, 1, 0), circles(0, 0.1L, 1, 0));
  pass_edges("truncated cone", cone(1, 0.5, 0.2), circles(0.2L, 1, 0.5L, 0));
  pass_edges("cylinder", Cylinder{{0, 0, 0}, {0, 0, 1}, 0.3, true, {}}, circles(0.3L, 1, 0.3L, 0));
  pass_edges("box", Box{{-0.5, -0.4, 0}, {0.5, 0.4, 1}},
             {{{0.5L, -0.4L, 0.7L}, {0, 0, 1}}, {{-0.5L, 0.1L, 1}, {0, 1, 0}}, {{0.2L, 0.4L, 0}, {1, 0, 0}}});
  pass_edges("icosphere", scenes::icosphere(3), corners_of(scenes::icosphere(3)));
  pass_edges("lathe", leaks::lathe(300, 4), corners_of(leaks::lathe(300, 4)));
}

TEST(ClosedMeshes, LeakNoRaysAimedAtTheirEdgesAndVertices) {
  const std::pair<const char*, Mesh> meshes[] = {
      {"icosahedron", scenes::icosphere(0)},       {"sphere of 320", scenes::icosphere(2)},
      {"sphere of 20,480", scenes::icosphere(5)},  {"sphere of 327,680", scenes::icosphere(7)},
      {"torus", scenes::torus(300, 100)},          {"box", leaks::box()},
      {"lathe of 30 x 30", leaks::lathe(30, 30)},  {"lathe of 500 x 2", leaks::lathe(500, 2)},
      {"lathe of 3 x 5000", leaks::lathe(3, 5000)}};
  for (const auto& [name, mesh] : meshes) {
    Row row(6, std::string("leaks at the corners and edges of closed meshes: ") + name, Oracle::conservation, "rays");
    Scene scene = scenes::empty(1);
    scenes::add(scene, mesh, scenes::matte({1, 1, 1}));
    const auto made = compiled(scene);
    for (const auto aim : {leaks::CameraRay::vertices, leaks::CameraRay::edges}) {
      const leaks::Count found = leaks::count(made->geometry().triangles[0], aim, effort::cases(40'000), 1);
      row.count(found.rays, found.leaked);
    }
  }
}

/// Rays in all directions, along the surface too, from a hit on a convex shape: outward rays must not hit it again,
/// inward rays must.
void leave(Row& row, Random& random, const CompiledScene& scene, std::uint64_t rays, bool inwards,
           const Around& around = {}) {
  for (std::uint64_t tries = 0; tries < rays; ++tries) {
    Vec3 direction;
    const Look at = random_place(random, scene, around, direction);
    if (!at.found) continue;
    const Vec3 n = at.surface.back != inwards ? -at.surface.geometric_normal : at.surface.geometric_normal;
    Vec away = random.direction();
    if (random.chance(0.6)) away = unit(along_surface(random, scene, at) + Real(random.spread(1e-18, 1e-6)) * Vec(n));
    const Vec3 leaving = rounded(dot(away, Vec(n)) < 0 ? -away : away);
    if (!(dot(leaving, n) > 0)) continue;
    const Vec3 start = offset_origin(at.surface.point, at.surface.geometric_normal, leaving);
    const Look again = look(scene, start, leaving, at.hit.primitive);
    row.expect((again.found && again.surface.object == 0) == inwards);
  }
}

constexpr const char* self_hits = "0 self-hits ";
constexpr const char* lost_inside = "0 lost inside ";

TEST(RaysThatLeaveAShape, HitItAgainInwardsOnlyAtAnySizeAndPosition) {
  Random random(2);
  for (const bool inwards : {false, true})
    for (std::size_t which = 0; which < closed_shapes(1, {}).size(); ++which) {
      const Named named = closed_shapes(1, {})[which];
      if (!named.convex) continue;
      Row row(0, (inwards ? lost_inside : self_hits) + ("at scales 1e-9 .. 1e9, anywhere: " + named.name),
              Oracle::conservation, "rays");
      for (double size = 1e-9; size < 2e9; size *= 1e3)
        for (const double away : {0.0, 1.0, 1e4}) {
          const Vec3 at{away * size, -0.7 * away * size, 0.3 * away * size};
          leave(row, random, *compiled_shape(closed_shapes(size, at)[which], at), effort::cases(2'000), inwards);
        }
    }
}

TEST(RaysThatLeaveAShape, HitItAgainInwardsOnlyInScenesOfAnySize) {
  Random random(4);
  for (const bool inwards : {false, true})
    for (std::size_t which = 0; which < closed_shapes(1, {}).size(); ++which) {
      const Named named = closed_shapes(1, {})[which];
      if (!named.convex || std::holds_alternative<Mesh>(named.shape)) continue;
      Row row(0, (inwards ? lost_inside : self_hits) + ("at 1e-1 .. 1e-9 of the scene: " + named.name),
              Oracle::conservation, "rays");
      for (double size = 1e-1; size > 0.5e-9; size /= 10) {
        const Vec3 at{0.3, -0.2, 0.1};
        const auto scene = compiled_shape(closed_shapes(size, at)[which], at, 1);
        leave(row, random, *scene, effort::cases(2'000), inwards,
              {scene->frame.render_from_world(at), Real(scene->frame.render_from_world(size))});
      }
    }
}

TEST(RaysThatLeaveAShape, NeverHitAFlatShapeAgain) {
  Random random(3);
  const std::vector<Named> flat{{"disc", Disc{{0, 0, 0}, {0.3, 1, 0.2}, 1, 0.2, {}}},
                                {"plane", Plane{{0, 0, 0}, {0.3, 1, 0.2}, {}}},
                                {"triangle", Triangle{{{{-1, 0, 0.1}, {1, 0.2, 0}, {0, 0.9, 0.5}}}, {}, {}}}};
  for (const Named& named : flat) {
    Row row(0, "0 self-hits: " + named.name, Oracle::conservation, "rays");
    leave(row, random, *compiled_shape(named, {}), effort::cases(40'000), false);
  }
}

/// Adds the lit pixels of a scene, of which none may be in a shadow.
void expect_no_shadow(Row& row, Scene scene) {
  const auto with = stability::render(scene, 2).image.rgb;
  for (Light& light : scene.lights) light.shadows = false;
  const auto without = stability::render(scene, 2).image.rgb;
  for (std::size_t i = 0; i < with.size(); i += 3)
    if (without[i] > 0) row.expect(with[i] == without[i], "a dark pixel");
}

/// Surfaces that face their lights, and nothing else: the rays of the integrator.
TEST(ShadowRays, NeverHitTheSurfaceWhereTheyStart) {
  Row spheres(0, "0 self-hits: shadows on spheres of 1e-9 .. 1e9, anywhere", Oracle::conservation, "pixels");
  Row planes(0, "0 self-hits: shadows on planes from heights of 1e-9 .. 1e9", Oracle::conservation, "pixels");
  Row rooms(0, "0 self-hits: shadows in convex rooms", Oracle::conservation, "pixels");
  const auto at = [](double size, const Vec3& center, const Vec3& v) { return center + v * size; };
  for (double size = 1e-9; size < 2e9; size *= 1e3) {
    Scene scene = scenes::empty(effort::cases(100) < 100 ? 64 : 256);
    for (const double offset : {0.0, 1.0, 1e3, 1e6})
      for (const Vec3& from : {Vec3{3, 3, 3}, Vec3{-30, 2, 0}, Vec3{1.01, 0, 0}}) {
        const Vec3 center{offset * size, -offset * size, 0.7 * offset * size};
        Scene ball = scene;
        ball.camera = {at(size, center, {1, 2, 3}), center, {0, 1, 0}, 34};
        ball.lights = {scenes::point_light(at(size, center, from)), scenes::directional_light(-from)};
        scenes::add(ball, Sphere{center, size}, scenes::matte({1, 1, 1}));
        expect_no_shadow(spheres, ball);
      }
    for (const double tilt : {0.0, 3e-4, 1e-2}) {
      Scene plane = scene;
      plane.camera = {{0, size, 0}, {size, size * 0.9, 0.1 * size}, {0, 1, 0}, 90};
      plane.lights = {scenes::point_light({2 * size, 0.5 * size, size}), scenes::directional_light({-1, -0.01, 0})};
      scenes::add(plane, Plane{{0, 0, 0}, {0, 1, tilt}, {}}, scenes::matte({1, 1, 1}));
      expect_no_shadow(planes, plane);
    }
    for (const Shape& wall :
         {Shape{Sphere{{0, 0, 0}, size}}, Shape{scenes::placed(scenes::icosphere(3), size, {0, 0, 0})}}) {
      Scene room = scene;
      room.camera = {{0.1 * size, 0, 0}, {0, 0.2 * size, -size}, {0, 1, 0}, 130};
      room.lights = {scenes::point_light({0.3 * size, 0.4 * size, 0.2 * size})};
      scenes::add(room, wall, scenes::matte({1, 1, 1}));
      expect_no_shadow(rooms, room);
    }
  }
}

}  // namespace
