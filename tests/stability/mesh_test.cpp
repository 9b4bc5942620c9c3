// Coarse smooth meshes compared with the sphere that they approximate.
#include <gtest/gtest.h>

#include <functional>
#include <numbers>

#include "tests/stability/table.h"

namespace {

using namespace tracer;
using stability::Oracle;
using stability::Row;

/// A lit sphere or its mesh, without pixels on silhouettes.
Scene lit(Shape shape) {
  Scene scene = scenes::empty(128, {{0, 0, 5}, {0, 0, 0}, {0, 1, 0}, 20});
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

}  // namespace
