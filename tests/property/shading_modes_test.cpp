// One triangle under flat, smooth and Gouraud shading, each pixel compared with the formula.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <utility>

#include "tests/support/long_vec.h"
#include "tests/support/reference_optics.h"
#include "tests/support/scenes.h"

namespace {

using oracle::Real;
using oracle::Vec;
using namespace tracer;

const std::array<Vec3, 3> corners{Vec3{-1, -1, 0}, {1.2, -0.8, 0.1}, {0.1, 1.1, -0.1}};
const std::array<Vec3, 3> normals{Vec3{-0.5, -0.3, 1}, {0.6, -0.2, 1}, {0, 0.7, 1}};

Scene lit_triangle(Material::Shading shading) {
  Scene scene = scenes::empty(64, {{0.2, 0.1, 4}, {0, 0, 0}, {0, 1, 0}, 30});
  scene.lights = {scenes::point_light({2, 1.5, 2}), scenes::directional_light({1, -1, -2}, {0.2, 0.2, 0.2})};
  for (Light& light : scene.lights) light.shadows = false;
  scene.lights[0].attenuation.kind = Attenuation::Kind::inverse_square;
  scene.lights[0].intensity = 8;
  Material material = scenes::matte({0.6, 0.6, 0.6});
  material.model = Material::Model::phong;
  material.specular = 0.5;
  material.shininess = 12;
  material.shading = shading;
  scenes::add(scene, Triangle{corners, normals, {}}, material);
  return scene;
}

/// I_local at a place with a unit normal, by the formula of scene.h.
Real local(const Scene& scene, const Vec& place, const Vec& normal) {
  const Material& material = scene.materials[0];
  const bool parallel = scene.camera.type == Camera::Type::orthographic;
  const Vec to_eye = unit(Vec(scene.camera.position) - (parallel ? Vec(scene.camera.look_at) : place));
  Real sum = 0;
  for (const Light& light : scene.lights) {
    const auto* point = std::get_if<PointLight>(&light.source);
    const Vec offset = point != nullptr ? Vec(point->position) - place
                                        : -unit(Vec(std::get<DirectionalLight>(light.source).direction));
    const Vec to_light = unit(offset);
    const Real n_l = dot(normal, to_light);
    if (n_l <= 0) continue;
    sum += light.color.r * light.intensity / dot(offset, offset) *
           (0.6L * n_l + Real(material.specular) * oracle::highlight(material, normal, to_light, to_eye));
  }
  return sum;
}

/// Origin and unit direction of the ray through the center of pixel (x, y).
std::pair<Vec, Vec> camera_ray(const Scene& scene, std::uint32_t x, std::uint32_t y) {
  const Camera& camera = scene.camera;
  if (camera.type == Camera::Type::perspective) return {camera.position, oracle::through(scene, x, y)};
  const Vec forward = unit(Vec(camera.look_at) - Vec(camera.position)), right = unit(cross(forward, camera.up));
  const Real pixel = Real(camera.height) / scene.image.height, half = Real(scene.image.height) / 2;
  return {
      Vec(camera.position) + (pixel * (x + 0.5L - half)) * right + (pixel * (half - y - 0.5L)) * cross(right, forward),
      forward};
}

/// Weights of the corners where the pixel's ray intersects the triangle's plane (Cramer's rule).
std::array<Real, 3> weights(const Scene& scene, std::uint32_t x, std::uint32_t y) {
  const auto [o, d] = camera_ray(scene, x, y);
  const Vec a = corners[0], e1 = Vec(corners[1]) - a, e2 = Vec(corners[2]) - a, s = o - a;
  const Real volume = dot(cross(d, e2), e1);
  const Real u = dot(cross(d, e2), s) / volume, v = dot(cross(s, e1), d) / volume;
  return {1 - u - v, u, v};
}

template <class Expected>
void expect_shading(const Scene& scene, const Expected& expected) {
  const Image image = scenes::render(scene).image;
  int inside = 0;
  for (std::uint32_t y = 0; y < 64; ++y)
    for (std::uint32_t x = 0; x < 64; ++x) {
      const auto w = weights(scene, x, y);
      const Real margin = std::fmin(w[0], std::fmin(w[1], w[2]));
      if (std::fabs(margin) < 1e-5L) continue;  // on an edge
      inside += margin > 0 ? 1 : 0;
      // The corners are floats of the render space.
      const Real value = margin > 0 ? expected(scene, w) : 0;
      ASSERT_NEAR(image.pixel(x, y)[0], static_cast<double>(value), 1e-6) << x << " " << y;
    }
  EXPECT_GT(inside, 500);
}

Vec place_of(const std::array<Real, 3>& w) {
  return w[0] * Vec(corners[0]) + w[1] * Vec(corners[1]) + w[2] * Vec(corners[2]);
}

const Vec face = unit(cross(Vec(corners[1]) - Vec(corners[0]), Vec(corners[2]) - Vec(corners[0])));

TEST(FlatShading, UsesTheFacesNormal) {
  expect_shading(lit_triangle(Material::Shading::flat),
                 [](const Scene& scene, const auto& w) { return local(scene, place_of(w), face); });
}

TEST(FlatPolygonShading, UsesTheLightAtTheCentroid) {
  const Vec centroid = place_of({1.0L / 3, 1.0L / 3, 1.0L / 3});
  const auto light_of_centroid = [&](const Scene& scene, const auto&) { return local(scene, centroid, face); };
  Scene scene = lit_triangle(Material::Shading::flat_polygon);
  expect_shading(scene, light_of_centroid);
  scene.camera = scenes::orthographic({2, 1, 40}, {0, 0, 0}, 2.2);
  expect_shading(scene, light_of_centroid);
}

TEST(FlatPolygonShading, HasOneColorForEachTriangleWithItsShadow) {
  Scene scene = scenes::empty(96, {{0, 0, 6}, {0, 0, 0}, {0, 1, 0}, 30});
  scene.lights = {scenes::point_light({1, 2, 5})};
  Material material = scenes::matte({0.9, 0.9, 0.9});
  material.shading = Material::Shading::flat_polygon;
  const Mesh ball = scenes::icosphere(1, true);
  scenes::add(scene, ball, material);
  const auto lit_values = [&] {
    const Image image = scenes::render(scene).image;
    std::set<float> values;
    for (std::size_t i = 0; i < image.rgb.size(); i += 3)
      if (image.rgb[i] > 0) values.insert(image.rgb[i]);
    return values;
  };
  const std::set<float> open = lit_values();
  EXPECT_LE(open.size(), ball.triangles.size());
  EXPECT_GT(open.size(), 20U);
  scenes::add(scene, Sphere{{0.7, 1.4, 3.5}, 0.3}, scenes::matte({0, 0, 0}));  // shades a part of the ball
  const std::set<float> shaded = lit_values();
  EXPECT_LT(shaded.size(), open.size());
  EXPECT_TRUE(std::includes(open.begin(), open.end(), shaded.begin(), shaded.end()));
}

TEST(SmoothShading, InterpolatesNormalsAndMakesThemUnit) {
  expect_shading(lit_triangle(Material::Shading::smooth), [](const Scene& scene, const auto& w) {
    Vec normal;
    for (std::size_t i = 0; i < 3; ++i) normal = normal + w[i] * oracle::unit(normals[i]);
    return local(scene, place_of(w), oracle::unit(normal));
  });
}

Real light_of_corners(const Scene& scene, const std::array<Real, 3>& w) {
  Real sum = 0;
  for (std::size_t i = 0; i < 3; ++i) sum += w[i] * local(scene, corners[i], oracle::unit(normals[i]));
  return sum;
}

TEST(GouraudShading, InterpolatesTheLightOfTheCorners) {
  expect_shading(lit_triangle(Material::Shading::gouraud), light_of_corners);
}

TEST(GouraudShading, HasHighlightsForTheDirectionOfParallelRays) {
  for (const double distance : {0.5, 4.0, 400.0}) {
    Scene scene = lit_triangle(Material::Shading::gouraud);
    scene.camera = scenes::orthographic({0.2 * distance, 0.1 * distance, distance}, {0, 0, 0}, 2.2);
    expect_shading(scene, light_of_corners);
  }
}

TEST(GouraudShading, HasHighlightsInAMirrorThatDoNotDependOnItsDistance) {
  const auto image = [](double distance) {
    Scene scene = lit_triangle(Material::Shading::gouraud);
    scene.camera = scenes::orthographic({0, 0, 1}, {0, 0, 2}, 2.2);
    scenes::add(scene, Plane{{0, 0, distance}, {0, 0, -1}, {}}, scenes::mirror());
    return scenes::render(scene).image;
  };
  const Image near = image(1.5), far = image(50);
  EXPECT_GT(*std::max_element(near.rgb.begin(), near.rgb.end()), 0.3f);
  for (std::size_t i = 0; i < near.rgb.size(); ++i) ASSERT_NEAR(near.rgb[i], far.rgb[i], 1e-6) << i;
}

}  // namespace
