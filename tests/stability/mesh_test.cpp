// Meshes of slivers, needles, lines and duplicates compared with Cramer's rule in long double; coarse smooth meshes
// compared with the sphere that they approximate.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <numbers>

#include "tests/stability/table.h"
#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/unit/shapes/look.h"

namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;
using namespace tracer;
using stability::Oracle;
using stability::Row;

/// Multiples of 2^-20 within (-1, 1): exact in render space for every precision.
Vec3 on_grid(const Vec& p) {
  const auto rounded = [](Real c) { return static_cast<double>(std::round(c * 0x1p20L) * 0x1p-20L); };
  return {rounded(p.x), rounded(p.y), rounded(p.z)};
}

enum class Kind { needle, sliver, plump, line, point };

std::array<Vec3, 3> corners_of(Random& random, Kind kind) {
  const Vec a = random.vector(0.9), b = random.vector(0.9);
  const Vec between = a + random.in(0.1, 0.9) * (b - a);
  switch (kind) {
    case Kind::needle:  // one edge a few grid steps long
      return {on_grid(a), on_grid(b), on_grid(b + random.spread(2e-6, 1e-4) * random.direction())};
    case Kind::sliver:  // the third corner a few grid steps beside the edge
      return {on_grid(a), on_grid(b), on_grid(between + random.spread(2e-6, 1e-4) * random.across(unit(b - a)))};
    case Kind::plump:
      return {on_grid(a), on_grid(b), on_grid(random.vector(0.9))};
    case Kind::line:
      return {on_grid(a), on_grid(b), on_grid(a)};
    case Kind::point:
      break;
  }
  return {on_grid(a), on_grid(a), on_grid(a)};
}

/// Hit of one triangle by Cramer's rule: the distance, the margin to the edges, and its error bound in double
/// precision.
struct CramerHit {
  Real t = -1, inside = -1, error_bound = 0;
};

CramerHit cramer_hit(const std::array<Vec3, 3>& corners, const Vec& o, const Vec& d) {
  const Vec a = corners[0], e1 = Vec(corners[1]) - a, e2 = Vec(corners[2]) - a, s = o - a, n = cross(e1, e2);
  const Real area = length(n), volume = -dot(d, n);
  if (area == 0 || volume == 0) return {};
  const Real u = dot(cross(d, e2), s) / volume, v = dot(cross(s, e1), d) / volume;
  const Real inside =
      std::fmin(u * area / length(e2), std::fmin(v * area / length(e1), (1 - u - v) * area / length(e2 - e1)));
  const Real sine = std::fabs(volume) / area;
  return {dot(s, n) / volume, inside * sine, 64 * 0x1p-53L * (1 + length(o))};
}

TEST(NeedlesSliversAndLines, MatchCramersRule) {
  Row row(5, "needles, slivers, zero area, doubles: hits and misses", Oracle::closed_form, "rays");
  row.bound("the ray passes an edge by less than 64 roundings of a double, or touches two triangles", 0.02);
  Random random(1);
  for (std::uint64_t m = 0; m < effort::cases(250); ++m) {
    Mesh mesh;
    for (int i = 0; i < 30; ++i) {
      const Kind kind = i < 10   ? Kind::needle
                        : i < 20 ? Kind::sliver
                        : i < 24 ? Kind::plump
                        : i < 27 ? Kind::line
                                 : Kind::point;
      auto corners = corners_of(random, kind);
      if (i == 9) corners = {mesh.positions[0], mesh.positions[1], mesh.positions[2]};  // a double of the first
      const auto first = static_cast<std::uint32_t>(mesh.positions.size());
      mesh.positions.insert(mesh.positions.end(), corners.begin(), corners.end());
      mesh.triangles.push_back({first, first + 1, first + 2});
    }
    mesh.positions.push_back({-1, -1, -1});  // holds the frame, which no triangle then decides
    mesh.positions.push_back({0.5, 0.5, 0.5});
    Scene scene = scenes::empty(1);
    scenes::add(scene, mesh, scenes::matte({1, 1, 1}));
    const auto made = compiled(scene);
    const auto corners_at = [&](std::size_t i) {
      return std::array{mesh.positions[3 * i], mesh.positions[3 * i + 1], mesh.positions[3 * i + 2]};
    };
    for (int ray = 0; ray < 120; ++ray) {
      // At the inside of a triangle, or close beside.
      const auto [a, b, c] = corners_at(random.below(24));
      Real u = random.in(0, 1), v = random.in(0, 1);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      Vec target = (1 - u - v) * Vec(a) + u * Vec(b) + v * Vec(c);
      if (random.chance(0.4)) target = target + random.spread(1e-8, 1e-2) * random.direction();
      const Vec3 o = rounded(target + random.spread(0.01, 10) * random.direction());
      const Vec3 d = rounded(unit(target - Vec(o)));
      Real nearest = HUGE_VALL, second = HUGE_VALL;
      bool certain = true;
      std::uint32_t who = PrimitiveRef::none;
      for (std::uint32_t i = 0; i < 30; ++i) {
        const CramerHit hit = cramer_hit(corners_at(i), o, d);
        if (hit.t < -1e-12L || hit.error_bound == 0) continue;
        certain &= std::fabs(hit.inside) > hit.error_bound && std::fabs(hit.t) > 1e-12L;
        if (hit.inside < 0 || i == 9) continue;  // the first stands for its double
        second = std::fmin(second, std::fmax(nearest, hit.t));
        if (hit.t < nearest) nearest = hit.t, who = i < 9 ? i : i - 1;  // the double is left out
      }
      certain &= !(second - nearest < 1e-9L);
      if (!certain) row.undecided();
      const Look at = look(*made, made->frame.render_from_world(o), d);
      row.expect(!certain || (at.found ? at.hit.primitive.primitive : PrimitiveRef::none) == who);
    }
  }
}

/// A lit sphere or its mesh, without pixels on silhouettes.
Scene lit(Shape shape) {
  Scene scene = scenes::empty(128);
  scene.camera = {{0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 20};
  scene.lights = {scenes::point_light({4, 3, 1.5})};
  scenes::add(scene, std::move(shape), scenes::matte({1, 1, 1}));
  return scene;
}

constexpr double icosahedron_edge = 1.05;

/// Pixels inside of the silhouettes of the sphere and of a mesh with edges of this length.
template <class Visit>
void for_each_pixel_inside(double edge, const Visit& visit) {
  const double radii_per_pixel = 2 * 5 * std::tan(10 * std::numbers::pi / 180) / 128;
  for (std::size_t y = 0; y < 128; ++y)
    for (std::size_t x = 0; x < 128; ++x) {
      const double off = std::hypot(static_cast<double>(x) - 63.5, static_cast<double>(y) - 63.5) * radii_per_pixel;
      if (off < 0.9 * std::cos(edge / 1.6)) visit(3 * (128 * y + x));
    }
}

/// A mesh with vertices on the sphere and the sphere's normals.
Mesh with_normals(Mesh mesh) {
  mesh.normals = mesh.positions;
  return mesh;
}

/// Adds the pixels of the meshes with an error above `constant` times the edge length to the power of `order`.
void converge(Row& row, double constant, int order, const std::function<Mesh(int)>& mesh_of_level) {
  const Image ball = stability::render(lit(Sphere{{0, 0, 0}, 1})).image;
  double largest = 0;
  for (const int level : {1, 2, 3, 4, 5, 6}) {
    const Image mesh = stability::render(lit(mesh_of_level(level))).image;
    const double edge = icosahedron_edge * std::pow(0.5, level);
    for_each_pixel_inside(edge, [&](std::size_t i) {
      const double off = std::fabs(mesh.rgb[i] - ball.rgb[i]) / std::pow(edge, order);
      largest = std::max(largest, off);
      row.expect(off <= constant, "level " + std::to_string(level) + ": " + std::to_string(off));
    });
  }
  row.note("largest " + std::to_string(largest).substr(0, 4) + " edge^" + std::to_string(order));
}

TEST(SmoothNormals, OfCoarseMeshesConvergeToThoseOfASphere) {
  Row given(18, "balls of triangles, true normals: to the ball with the edge^2", Oracle::closed_form, "pixels");
  converge(given, 0.4, 2, [](int level) { return with_normals(scenes::icosphere(level)); });
  // Where the sizes of the triangles around a corner jump, their mean normal is off with the edge.
  Row weighted(18, "balls of triangles, area-weighted normals: with the edge", Oracle::closed_form, "pixels");
  converge(weighted, 0.15, 1, [](int level) { return scenes::icosphere(level, true); });
}

TEST(SmoothNormals, LeaveNoFacetDarkThatIsLitOnTheSphere) {
  Row row(18, "shadow terminator: no dark facet where the ball is lit", Oracle::closed_form, "pixels");
  const Image ball = stability::render(lit(Sphere{{0, 0, 0}, 1})).image;
  for (const int level : {1, 2, 3, 4}) {
    const double edge = icosahedron_edge * std::pow(0.5, level);
    const Image mesh = stability::render(lit(scenes::icosphere(level, true))).image;
    for_each_pixel_inside(edge, [&](std::size_t i) {
      if (ball.rgb[i] > edge * edge) row.expect(mesh.rgb[i] > 0, "level " + std::to_string(level));
    });
  }
}

}  // namespace
