/// Lights that brighten a surface from behind: Hall's diffuse and specular transmission.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/support/scenes.h"

using namespace tracer;

namespace {

constexpr double pi = std::numbers::pi;

Material leaf(double reflected, double transmitted) {
  Material material = scenes::matte({1, 1, 1});
  material.diffuse = reflected;
  material.diffuse_transmission = transmitted;
  return material;
}

/// Parallel rays along `direction` to the origin.
Camera parallel(const Vec3& direction, double height) {
  Camera camera;
  camera.type = Camera::Type::orthographic;
  camera.position = {-5 * direction.x, -5 * direction.y, -5 * direction.z};
  camera.look_at = {0, 0, 0};
  camera.up = {0, 1, 0};
  camera.height = height;
  return camera;
}

TEST(TransmittedLight, IsProportionalToTheCosineBehindALeaf) {
  Scene scene = scenes::empty(1);
  scene.camera = parallel({0, 0, -1}, 1e-6);
  Material material = leaf(0.25, 0.75);
  material.color = Color{0.5, 0.5, 0.5};
  material.diffuse_transmission_color = Color{0.5, 1, 0.25};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, material);
  scene.lights = {scenes::point_light({3, 0, -4}, {1, 0.5, 0.25})};
  scene.lights[0].attenuation.kind = Attenuation::Kind::inverse_square;
  scene.lights[0].intensity = 10;
  const double arriving = 0.75 * 10 / 25.0 * 0.8;
  const std::vector<float> rgb = scenes::render(scene).image.rgb;
  EXPECT_NEAR(rgb[0], arriving * 0.5, 1e-8);
  EXPECT_NEAR(rgb[1], arriving * 0.5, 1e-8);
  EXPECT_NEAR(rgb[2], arriving * 0.25 * 0.25, 1e-8);
}

/// A lamp in the middle of a sphere sends 4 pi^2 I; the sides of the sphere have the radiosities pi K_d I / R^2 and
/// pi K_dt I / R^2 all over.
TEST(TransmittedLight, SharesTheLightOfALampWithTheReflectedOne) {
  constexpr double radius = 1.5, intensity = 2, reflected = 0.3, transmitted = 0.6;
  double power = 0;
  for (const double distance : {0.5, 6.0}) {  // inside, outside
    Scene scene = scenes::empty(9);
    scene.camera = {{0, 0, distance}, {0, 0, 0}, {0, 1, 0}, 20};
    scenes::add(scene, Sphere{{0, 0, 0}, radius}, leaf(reflected, transmitted));
    scene.lights = {scenes::point_light({0, 0, 0})};
    scene.lights[0].attenuation.kind = Attenuation::Kind::inverse_square;
    scene.lights[0].intensity = intensity;
    const std::vector<float> rgb = scenes::render(scene).image.rgb;
    const double share = distance < radius ? reflected : transmitted;
    for (const float value : rgb) EXPECT_NEAR(value, share * intensity / (radius * radius), 1e-7);
    power += rgb[0] * pi * 4 * pi * radius * radius;
  }
  EXPECT_NEAR(power / (4 * pi * pi * intensity), reflected + transmitted, 1e-6);
}

/// Light in a medium below a plane, seen from above.
struct Boundary {
  double ior, incidence;  ///< degrees below the plane
  [[nodiscard]] double sine() const { return ior * std::sin(incidence * pi / 180); }
};

double seen_along(const Boundary& boundary, double angle, Material::Model model, double shininess) {
  Scene scene = scenes::empty(1);
  scene.camera = parallel({-std::sin(angle), 0, -std::cos(angle)}, 1e-6);
  Material water = scenes::matte({0, 0, 0});
  water.model = model;
  water.transmission = 1;
  water.ior = boundary.ior;
  water.specular_transmission = 0.5;
  water.shininess = shininess;
  scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, water);
  const double incidence = boundary.incidence * pi / 180;
  scene.lights = {scenes::directional_light({std::sin(incidence), 0, std::cos(incidence)})};
  return scenes::render(scene).image.rgb[0];
}

TEST(TransmittedLight, HasItsHighlightInSnellsDirection) {
  for (const Boundary& boundary : {Boundary{1.33, 30}, Boundary{1.5, 10}, Boundary{0.8, 60}, Boundary{1, 40}}) {
    const double peak = std::asin(boundary.sine());
    EXPECT_NEAR(seen_along(boundary, peak, Material::Model::phong, 1000), 0.5, 1e-7);
    for (const double aside : {-0.1, 0.05, 0.1}) {
      const double expected = 0.5 * std::pow(std::cos(aside), 40);
      EXPECT_NEAR(seen_along(boundary, peak + aside, Material::Model::phong, 40), expected, 1e-7);
      EXPECT_NEAR(seen_along(boundary, peak + aside, Material::Model::blinn_phong, 160), expected, 1e-7);
      EXPECT_EQ(seen_along(boundary, peak + aside, Material::Model::lambert, 40), 0);
    }
  }
}

TEST(TransmittedLight, HasNoHighlightAtTotalReflection) {
  for (const double shininess : {0.0, 1.0, 50.0})
    for (const double angle : {0.0, 0.7, 1.4})
      EXPECT_EQ(seen_along({1.5, 45}, angle, Material::Model::phong, shininess), 0);
}

enum class Kind { flat, smooth, gouraud, flat_polygon, bump, textured, instance };

/// One triangle with vertex normals, lit along `direction`.
Scene lit_triangle(Kind kind, const Vec3& direction, double reflected, double transmitted) {
  Scene scene = scenes::empty(32);
  scene.camera = {{0, 0.2, 4}, {0, 0, 0}, {0, 1, 0}, 35};
  Material material = leaf(reflected, transmitted);
  scene.textures = {{NoiseTexture{{Color{0, 0, 0}, Color{1, 1, 1}}, 2}, {3, 3}, {}, "/textures/t"}};
  if (kind == Kind::flat) material.shading = Material::Shading::flat;
  if (kind == Kind::gouraud) material.shading = Material::Shading::gouraud;
  if (kind == Kind::flat_polygon) material.shading = Material::Shading::flat_polygon;
  if (kind == Kind::bump) material.bump = Bump{TextureId{0}, 0.2};
  if (kind == Kind::textured) material.color = material.diffuse_transmission_color = TextureId{0};
  const MaterialId id = scenes::add(scene, material);
  const Triangle triangle{
      {Vec3{-1, -1, 0}, {1.2, -0.8, 0.1}, {0.1, 1.1, -0.1}}, {{Vec3{-0.9, -0.3, 1}, {0.9, -0.2, 1}, {0, 0.7, 1}}}, {}};
  if (kind == Kind::instance) {
    scene.prototypes.push_back({.objects = {{.shape = triangle, .material = id}}, .path = "/prototypes/p"});
    scenes::add(scene, Instance{PrototypeId{0}, {}}, id);
    scene.objects.back().transform = Transform{{{{0.8, 0.2, 0, 0.1}, {-0.2, 1.1, 0.1, 0}, {0, 0, 1.3, -0.2}}}};
  } else {
    scenes::add(scene, triangle, id);
  }
  scene.lights = {scenes::directional_light(direction, {1, 0.75, 0.5})};
  return scene;
}

/// The same surface under the opposite light.
TEST(TransmittedLight, EqualsTheReflectedLightOfTheOppositeSideBitForBit) {
  for (const Kind kind :
       {Kind::flat, Kind::smooth, Kind::gouraud, Kind::flat_polygon, Kind::bump, Kind::textured, Kind::instance})
    for (const Vec3& direction : {Vec3{0.2, -0.4, -1}, Vec3{1, 0.1, -0.5}}) {
      const Rendered front = scenes::render(lit_triangle(kind, direction, 0.7, 0));
      const Vec3 opposite{-direction.x, -direction.y, -direction.z};
      const Rendered behind = scenes::render(lit_triangle(kind, opposite, 0, 0.7));
      EXPECT_EQ(front.image.rgb, behind.image.rgb) << static_cast<int>(kind);
      EXPECT_GT(*std::max_element(front.image.rgb.begin(), front.image.rgb.end()), 0.2F);
    }
}

TEST(TransmittedLight, AddsNothingWhereTheLightIsInFront) {
  const Vec3 direction{0, 0, -1};  // all vertex normals are on its side
  for (const Kind kind : {Kind::flat, Kind::smooth, Kind::gouraud, Kind::textured})
    EXPECT_EQ(scenes::render(lit_triangle(kind, direction, 0.7, 0.9)).image.rgb,
              scenes::render(lit_triangle(kind, direction, 0.7, 0)).image.rgb);
}

TEST(TransmittedLight, IsScaledByTheOpacity) {
  Scene scene = lit_triangle(Kind::flat, {0, 0, 1}, 0, 0.8);
  const std::vector<float> whole = scenes::render(scene).image.rgb;
  scene.materials[0].opacity = Color{0.5, 0.25, 1};
  const std::vector<float> part = scenes::render(scene).image.rgb;
  const float shares[] = {0.5F, 0.25F, 1};
  for (std::size_t i = 0; i < whole.size(); ++i) EXPECT_FLOAT_EQ(part[i], whole[i] * shares[i % 3]);
}

TEST(TransmittedLight, IsBlockedByWhatIsBetweenTheLeafAndTheLight) {
  Scene scene = lit_triangle(Kind::smooth, {0, 0, 1}, 0, 0.8);
  scenes::add(scene, Plane{{0, 0, -2}, {0, 0, 1}, {}}, scenes::matte({0, 0, 0}));
  for (const float value : scenes::render(scene).image.rgb) EXPECT_EQ(value, 0);
  scene.lights[0].shadows = false;
  const std::vector<float> unshadowed = scenes::render(scene).image.rgb;
  EXPECT_GT(*std::max_element(unshadowed.begin(), unshadowed.end()), 0.2F);
}

/// The front wall shows the light that came through the back wall and the inside; through the front wall one sees the
/// back wall, which shows the light that comes through it.
TEST(TransmittedLight, OfASolidPassesItsOtherWallAndItsInside) {
  Scene scene = scenes::empty(1);
  scene.camera = parallel({0, 0, -1}, 1e-6);
  scene.accuracy.max_depth = 4;
  Material slab = leaf(0, 0.5);
  slab.transmission = 0.8;
  slab.transmission_color = Color{1, 0.5, 0.25};
  slab.transparency = Material::Transparency::filtered;
  slab.absorption = {0.3, 0, 1};
  scenes::add(scene, Box{{-1, -1, -2}, {1, 1, 0}}, slab);
  scene.lights = {scenes::directional_light({0, 0, 1})};
  const std::vector<float> rgb = scenes::render(scene).image.rgb;
  const auto expected = [](double color, double absorption) {
    return 2 * 0.5 * (0.8 * color) * std::exp(-absorption * 2);
  };
  EXPECT_NEAR(rgb[0], expected(1, 0.3), 1e-7);
  EXPECT_NEAR(rgb[1], expected(0.5, 0), 1e-7);
  EXPECT_NEAR(rgb[2], expected(0.25, 1), 1e-7);
}

}  // namespace
