// Rays that leave a surface do not hit it again, and rays inside a closed one do not leave it.
#include <gtest/gtest.h>

#include "tests/stability/table.h"
#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/unit/shapes/look.h"

namespace {

using namespace tracer;
using stability::Oracle;
using stability::Row;

/// Number of pixels that differ between the scene with and without shadows.
std::uint64_t shadowed(Scene scene, std::uint64_t& lit) {
  const auto with = stability::render(scene, 2).image.rgb;
  for (Light& light : scene.lights) light.shadows = false;
  const auto without = stability::render(scene, 2).image.rgb;
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < with.size(); i += 3) {
    lit += without[i] > 0 ? 1 : 0;
    count += with[i] != without[i] ? 1 : 0;
  }
  return count;
}

/// An outside view of a shape of about `size` around `center`, lit from outside.
Scene view(const Vec3& center, double size, const Vec3& from) {
  Scene scene = scenes::empty(effort::cases(100) < 100 ? 64 : 256);
  const auto at = [&](const Vec3& v) {
    return Vec3{center.x + v.x * size, center.y + v.y * size, center.z + v.z * size};
  };
  scene.camera = {at({1, 2, 3}), center, {0, 1, 0}, 34};
  scene.lights = {scenes::point_light(at(from)), scenes::directional_light({-from.x, -from.y, -from.z})};
  return scene;
}

TEST(SelfHits, DoNotOccurOnSpheresOfAnySizeAndPosition) {
  Row row(0, "0 self-hits: shadows on spheres of 1e-9 .. 1e9, anywhere", Oracle::conservation, "pixels");
  std::uint64_t dark = 0, lit = 0;
  for (double radius = 1e-9; radius < 2e9; radius *= 1e3)
    for (const double offset : {0.0, 1.0, 1e3, 1e6})
      for (const Vec3& from : {Vec3{3, 3, 3}, Vec3{-30, 2, 0}, Vec3{1.01, 0, 0}}) {
        const Vec3 center{offset * radius, -offset * radius, 0.7 * offset * radius};
        Scene scene = view(center, radius, from);
        scenes::add(scene, Sphere{center, radius}, scenes::matte({1, 1, 1}));
        dark += shadowed(scene, lit);
      }
  row.count(lit, dark, "dark pixels");
}

TEST(SelfHits, DoNotOccurOnSpheresThatAreSmallOrLargeInTheirScene) {
  Row row(0, "0 self-hits: shadows on spheres of 1e-11 .. 1e6 of their scene", Oracle::conservation, "pixels");
  std::uint64_t dark = 0, lit = 0;
  for (double radius = 1e-8; radius < 1e9; radius *= 10) {
    Scene scene = view({0.3, 0.2, 0.1}, radius, {3, 3, 3});
    scenes::add(scene, Sphere{{0.3, 0.2, 0.1}, radius}, scenes::matte({1, 1, 1}));
    // Far behind the camera, where they neither are seen nor cast shadows: they hold the frame at some 2000 units.
    for (const double x : {-1e3, 1e3})
      scenes::add(scene, Sphere{{x * std::max(1.0, radius), -1e3, 1e3 * std::max(1.0, radius)}, 1}, MaterialId{0});
    scene.lights.pop_back();
    dark += shadowed(scene, lit);
  }
  row.count(lit, dark, "dark pixels");
}

TEST(SelfHits, DoNotOccurOnConvexMeshes) {
  Row row(0, "0 self-hits: shadows on convex meshes", Oracle::conservation, "pixels");
  std::uint64_t dark = 0, lit = 0;
  for (const int level : {0, 1, 3, 5})
    for (const double size : {1e-6, 1.0, 1e6}) {
      Scene scene = view({0, 0, 0}, size, {3.1, 3.2, 2.9});
      scenes::add(scene, scenes::placed(scenes::icosphere(level), size, {0, 0, 0}), scenes::matte({1, 1, 1}));
      dark += shadowed(scene, lit);
    }
  row.count(lit, dark, "dark pixels");
}

TEST(SelfHits, DoNotOccurOnPlanesAtAnyAngleAndHeight) {
  Row row(0, "0 self-hits: shadows on planes from heights of 1e-9 .. 1e9", Oracle::conservation, "pixels");
  std::uint64_t dark = 0, lit = 0;
  for (double height = 1e-9; height < 2e9; height *= 1e3)
    for (const double tilt : {0.0, 0.3, 10.0}) {
      Scene scene = scenes::empty(128);
      scene.camera = {{0, height, 0}, {height, height * 0.9, 0.1 * height}, {0, 1, 0}, 90};
      scene.lights = {scenes::point_light({2 * height, 0.5 * height, height}),
                      scenes::directional_light({-1, -0.01, 0})};
      scenes::add(scene, Plane{{0, 0, 0}, {0, 1, tilt * 1e-3}, {}}, scenes::matte({1, 1, 1}));
      dark += shadowed(scene, lit);
    }
  row.count(lit, dark, "dark pixels");
}

TEST(SelfHits, DoNotOccurInsideAConvexRoom) {
  Row row(0, "0 self-hits: shadows in convex rooms", Oracle::conservation, "pixels");
  std::uint64_t dark = 0, lit = 0;
  for (const double size : {1e-6, 1.0, 1e6})
    for (const bool sphere : {true, false}) {
      Scene scene = scenes::empty(256);
      scene.camera = {{0.1 * size, 0, 0}, {0, 0.2 * size, -size}, {0, 1, 0}, 130};
      scene.lights = {scenes::point_light({0.3 * size, 0.4 * size, 0.2 * size})};
      if (sphere) {
        scenes::add(scene, Sphere{{0, 0, 0}, size}, scenes::matte({1, 1, 1}));
      } else {
        scenes::add(scene, scenes::placed(scenes::icosphere(3), size, {0, 0, 0}), scenes::matte({1, 1, 1}));
      }
      dark += shadowed(scene, lit);
    }
  row.count(lit, dark, "dark pixels");
}

// ---- leaks ---------------------------------------------------------------------------------------------------------

TEST(Leaks, DoNotOccurInClosedMeshes) {
  Row row(6, "leaks in images from inside closed meshes", Oracle::conservation, "rays");
  for (const int shape : {0, 1, 2})
    for (const Vec3& towards :
         {Vec3{1, 0, 0}, Vec3{-1, 0.1, 0}, Vec3{0, 1, 0.2}, Vec3{0.1, -1, 0}, Vec3{0, 0.1, 1}, Vec3{0.1, 0, -1}}) {
      Scene scene = scenes::empty(effort::cases(100) < 100 ? 60 : 250);
      scene.background.color = {1, 1, 1};
      const Mesh mesh = shape == 0 ? scenes::icosphere(1) : shape == 1 ? scenes::icosphere(6) : scenes::torus(300, 100);
      const Vec3 eye = shape == 2 ? Vec3{1.02, 0.03, 0.1} : Vec3{0.1, 0.05, -0.2};
      scene.camera = {eye, {eye.x + towards.x, eye.y + towards.y, eye.z + towards.z}, {0.3, 1, 0.9}, 100};
      scenes::add(scene, mesh, scenes::glowing({0, 0, 0}));
      const Image image = stability::render(scene, 2).image;
      for (std::size_t i = 0; i < image.rgb.size(); i += 3) row.expect(image.rgb[i] == 0);
    }
}

/// A mesh whose vertices are multiples of 2^-20, which are exact in render space for every precision.
Mesh snapped(Mesh mesh) {
  const auto rounded = [](double c) { return std::round(c * 0x1p20) * 0x1p-20; };
  for (Vec3& p : mesh.positions) p = {rounded(p.x), rounded(p.y), rounded(p.z)};
  return mesh;
}

/// Rays from random points inside closed meshes, exactly at their vertices or at points of their edges.
TEST(Leaks, DoNotOccurAtVerticesAndEdges) {
  oracle::Random random(1);
  for (const bool corners : {true, false}) {
    Row row(6, corners ? "leaks at the corners of closed meshes" : "leaks at the edges of closed meshes",
            Oracle::conservation, "rays");
    for (const int shape : {0, 2, 4, 5}) {
      Scene scene = scenes::empty(1);
      const Mesh mesh = snapped(shape == 5 ? scenes::torus(90, 40) : scenes::icosphere(shape));
      scenes::add(scene, mesh, scenes::matte({1, 1, 1}));
      const auto scene_compiled = compiled(scene);
      const auto traced = [&](const Vec3& p) { return oracle::Vec(scene_compiled->frame.render_from_world(p)); };
      // Around the middle of a ball, or of a torus's tube.
      for (std::uint64_t i = 0; i < effort::cases(65'000); ++i) {
        const auto& triangle = mesh.triangles[random.below(static_cast<std::uint32_t>(mesh.triangles.size()))];
        const std::uint32_t corner = random.below(3);
        const oracle::Vec a = traced(mesh.positions[triangle[corner]]);
        const oracle::Vec b = traced(mesh.positions[triangle[(corner + 1) % 3]]);
        const oracle::Vec target = corners ? a : a + oracle::Real(random.in(0, 1)) * (b - a);
        const double turn = random.in(0, 7);
        const Vec3 inside = shape == 5 ? Vec3{std::cos(turn), std::sin(turn), 0} : Vec3{};
        const oracle::Vec origin = traced(inside) + oracle::Real(random.in(0, 0.05)) * random.direction();
        const Vec3 o = rounded(origin);
        row.expect(look(*scene_compiled, o, rounded(unit(target - oracle::Vec(o)))).found);
      }
    }
  }
}

}  // namespace
