// A line crosses a closed surface an even number of times, alternately into and out of it, also close to an edge.
#include <gtest/gtest.h>

#include <iostream>

#include "tests/support/effort.h"
#include "tests/support/leaks.h"
#include "tests/support/random.h"
#include "tests/support/scenes.h"
#include "tracer/src/interaction/surface.h"

namespace {

using namespace tracer;
using oracle::Random;
using oracle::Real;
using oracle::Vec;

/// Follows a straight line through all surfaces with the integrator's ray offsets. Returns false unless it alternately
/// enters and leaves the solid and ends outside.
bool crosses_evenly(const CompiledScene& scene, Vec3 origin, const Vec3& direction, std::uint64_t& crossings) {
  PrimitiveRef from;
  bool inside = false;
  for (int hits = 0; hits < 20; ++hits) {
    Hit hit;
    scene.accelerator->intersect(
        {&origin.x, &origin.y, &origin.z, &direction.x, &direction.y, &direction.z, nullptr, &from, 1},
        {&hit.primitive, &hit.t, &hit.u, &hit.v}, Coherence::incoherent);
    if (!hit.primitive.hit()) return !inside;
    const Surface surface = surface_at(scene, hit, origin, direction);
    if (surface.back != inside) return false;
    inside = !inside;
    ++crossings;
    origin = offset_origin(surface.point, surface.geometric_normal, direction);
    from = hit.primitive;
  }
  return false;
}

/// A point where a surface is not smooth, and the edge's direction there (zero: none, or any).
struct Sharp {
  Vec point, along;
};

struct Solid {
  const char* name;
  Shape shape;
  std::vector<Sharp> sharp;
};

std::vector<Sharp> circle(Real radius, Real z) {
  std::vector<Sharp> points;
  for (int i = 0; i < 1000; ++i) {
    const Real x = std::cos(0.0063L * i), y = std::sin(0.0063L * i);
    points.push_back({{radius * x, radius * y, z}, {-y, x, 0}});
  }
  return points;
}

std::vector<Sharp> both(std::vector<Sharp> a, const std::vector<Sharp>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

std::vector<Sharp> corners_of(const Mesh& mesh) {
  std::vector<Sharp> corners;
  for (const Vec3& position : mesh.positions) corners.push_back({position, {}});
  return corners;
}

std::vector<Solid> solids() {
  return {
      {"cone", Cone{.apex = {0, 0, 1}, .base = {0, 0, 0}, .radius = 0.5, .u_axis = {}},
       both(circle(0, 1), circle(0.5L, 0))},
      {"steep cone", Cone{.apex = {0, 0, 1}, .base = {0, 0, 0}, .radius = 0.01, .u_axis = {}},
       both(circle(0, 1), circle(0.01L, 0))},
      {"flat cone", Cone{.apex = {0, 0, 0.1}, .base = {0, 0, 0}, .radius = 1, .u_axis = {}},
       both(circle(0, 0.1L), circle(1, 0))},
      {"truncated cone", Cone{.apex = {0, 0, 1}, .base = {0, 0, 0}, .radius = 0.5, .apex_radius = 0.2, .u_axis = {}},
       both(circle(0.2L, 1), circle(0.5L, 0))},
      {"cylinder", Cylinder{.from = {0, 0, 0}, .to = {0, 0, 1}, .radius = 0.3, .u_axis = {}},
       both(circle(0.3L, 1), circle(0.3L, 0))},
      {"box",
       Box{{-0.5, -0.4, 0}, {0.5, 0.4, 1}},
       {{{0.5L, -0.4L, 0.7L}, {0, 0, 1}}, {{-0.5L, 0.1L, 1}, {0, 1, 0}}, {{0.2L, 0.4L, 0}, {1, 0, 0}}}},
      {"icosphere", scenes::icosphere(3), corners_of(scenes::icosphere(3))},
      {"lathe", leaks::lathe(300, 4), corners_of(leaks::lathe(300, 4))},
      {"sphere", Sphere{{0, 0, 0}, 1}, both(circle(1, 0), circle(0.6L, 0.8L))}};
}

/// Least distance of a line to an edge, relative to the distance of its origin. Sides and caps overlap by 2^-46
/// (quadric.h) and rays start outside of that overlap: thinner parts may be entered and not left.
constexpr Real closest_pass = 0x1p-42L;

TEST(Crossings, OfClosedShapesAlternateBetweenInAndOutNearApexesRimsAndEdges) {
  Random random(1);
  for (const auto& [name, shape, sharp] : solids()) {
    Scene scene = scenes::empty(1);
    scenes::add(scene, shape, scenes::matte({1, 1, 1}));
    RenderControl control;
    const auto compiled = compile(scene, control);
    std::uint64_t crossings = 0, wrong = 0, rays = effort::cases(100'000);
    for (std::uint64_t i = 0; i < rays; ++i) {
      const Real distance = random.spread(2, random.chance(0.2) ? 1e6 : 10);
      const Real beside = random.spread(static_cast<double>(closest_pass * distance), 1e-1);
      const Sharp& edge = sharp[random.below(static_cast<std::uint32_t>(sharp.size()))];
      const Vec direction = random.direction();
      const bool smooth = !(length(edge.along) > 0);
      const Vec aside = smooth ? random.across(direction) : random.sign() * unit(cross(direction, edge.along));
      const Vec start = edge.point + beside * aside - distance * direction;
      const Vec3 origin = (*compiled)->frame.render_from_world(rounded(start));
      wrong += crosses_evenly(**compiled, origin, rounded(direction), crossings) ? 0 : 1;
    }
    std::cout << name << ": " << wrong << " of " << rays << " lines with " << crossings << " crossings are wrong\n";
    EXPECT_EQ(wrong, 0u) << name;
    EXPECT_GT(crossings, rays / 2) << name;
  }
}

}  // namespace
