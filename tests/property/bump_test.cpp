// Bump maps and normal maps, rendered through the public interface and compared with analytic normals.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/scenes.h"
#include "tracer/encode.h"
#include "tracer/src/math/vec.h"

namespace {

using namespace tracer;
using scenes::add;

Texture gradient(const Color& low, const Color& high, const Vec2& scale = {1, 1}) {
  return {.pattern = GradientTexture{{low, high}}, .scale = scale, .path = {}};
}

Texture constant(const Color& color) { return gradient(color, color); }

/// A height that grows by 1 with v.
Texture rising(const Vec2& scale = {1, 1}) { return gradient({}, {1, 1, 1}, scale); }

/// A texture for normal maps that means this direction, in the frame of the surface.
Texture direction(const Vec3& n) { return constant({n.x / 2 + 0.5, n.y / 2 + 0.5, n.z / 2 + 0.5}); }

/// One shape of `material`, whose textures are `texture`, seen along -y onto the origin's neighbourhood.
Scene scene_of(const Shape& shape, const Material& material, const Texture& texture,
               const Vec3& light = {0.3, 1, -0.5}) {
  Scene scene =
      scenes::empty(1, {.position = {0.21, 5, 0.13}, .look_at = {0.21, 0, 0.13}, .up = {0, 0, -1}, .fov_deg = 1});
  scene.textures.push_back(texture);
  scene.lights.push_back(scenes::directional_light(-normalize(light)));
  add(scene, shape, material);
  return scene;
}

double brightness(const Scene& scene) { return scenes::render(scene).image.rgb[0]; }

void expect_normal(const Scene& scene, const Vec3& normal) {
  const Vec3 light = -std::get<DirectionalLight>(scene.lights[0].source).direction;
  EXPECT_NEAR(brightness(scene), std::max(0.0, dot(normalize(normal), light)), 1e-6);
}

/// Every shape with a flat top at y = 0 (a sphere's pole is not one) has N = y there, u along +x, v along -z.
const Shape level_plane = Plane{{0, 0, 0}, {0, 1, 0}, {}};

Material bumped(double scale) {
  Material material = scenes::matte({1, 1, 1});
  material.bump = Bump{{0}, scale};
  return material;
}

Material mapped() {
  Material material = scenes::matte({1, 1, 1});
  material.normal_map = TextureId{0};
  return material;
}

TEST(Bump, OfConstantSlopeTiltsTheNormalByExactlyItsAngle) {
  for (const double slope : {0.0, 0.1, -0.5, 2.0}) {
    SCOPED_TRACE(slope);
    // v runs along e1 = n x e0 = -z, so heights grow towards -z and N leans to +z.
    expect_normal(scene_of(level_plane, bumped(slope), rising()), {0, 1, slope});
  }
}

TEST(Bump, HasTheHeightOfTheMeanOfTheChannels) {
  expect_normal(scene_of(level_plane, bumped(2), gradient({}, {0.9, 0.3, 0}), {0, 1, 1}), {0, 1, 0.8});
}

TEST(Bump, IsIndependentOfTheStretchAndRotationOfTheCoordinates) {
  // u along z, v = n x e0 = x; half a unit of height each 2 units
  Scene scene = scene_of(Plane{{0, 0, 0}, {0, 1, 0}, Vec3{0, 0, 1}}, bumped(0.5), rising({7, 0.5}));
  expect_normal(scene, {-0.25, 1, 0});
  Transform stretched;
  stretched.rows[0][0] = 3;  // the relief is stretched with its plane: three times the way for the same height
  scene.objects[0].transform = stretched;
  expect_normal(scene, {-0.25 / 3, 1, 0});
}

TEST(Bump, PerturbsEveryFlatShapeAlike) {
  // Height grows by 0.4 a unit along each shape's v, which is -z.
  const std::array<Vec2, 3> uvs{Vec2{-4, -4}, {4, -4}, {0, 4}};
  const std::pair<Shape, double> shapes_and_v_per_unit[] = {
      {Disc{{0, 0, 0}, {0, 1, 0}, 2, 0, {}}, 0.25},
      {Box{{-1, -1, -1}, {1, 0, 1}}, 0.5},
      {Cylinder{{0, -1, 0}, {0, 0, 0}, 2, true, {}}, 0.25},
      {Triangle{{Vec3{-4, 0, 4}, {4, 0, 4}, {0, 0, -4}}, {}, uvs}, 1},
      {Mesh{{{-4, 0, 4}, {4, 0, 4}, {0, 0, -4}}, {{0, 1, 2}}, {}, {uvs.begin(), uvs.end()}}, 1},
  };
  for (const auto& [shape, v_per_unit] : shapes_and_v_per_unit) {
    SCOPED_TRACE(shape.index());
    expect_normal(scene_of(shape, bumped(0.4 / v_per_unit), rising(), {0.2, 1, 0.4}), {0, 1, 0.4});
  }
}

TEST(Bump, OnASphereIsTheSlopeOverItsRadius) {
  const double radius = 2;
  // v = 1 - theta / pi climbs towards the pole: by 1 / (pi R) a unit of length.
  Scene scene = scene_of(Sphere{{0, 0, 0}, radius, {0, 0, 1}, {1, 0, 0}}, bumped(1.5), rising(), {0, 1, 0});
  scene.camera.position = {0, 9, 0};
  scene.camera.look_at = {0, 0, 0};  // theta = 90 degrees: v along z
  expect_normal(scene, {0, 1, 1.5 / (std::numbers::pi * radius)});
}

TEST(Bump, IsMirroredOnTheBackSide) {
  // The plane's front is below; its v then runs along n x e0 = +z. Seen from behind, what is a bump is a dent.
  expect_normal(scene_of(Plane{{0, 0, 0}, {0, -1, 0}, {}}, bumped(0.5), rising()), -Vec3{0, -1, -0.5});
}

TEST(Bump, IsBitIdenticalUnderScalingByAPowerOfTwo) {
  for (const int exponent : {-40, 13, 50}) {
    const double k = std::ldexp(1, exponent);
    const auto at_scale = [](double factor) {
      Scene scene = scenes::empty(24, {.position = Vec3{0, 3, 4} * factor, .look_at = {}, .fov_deg = 30});
      scene.textures = {{.pattern = NoiseTexture{{Color{}, Color{1, 1, 1}}, 3}, .scale = {5, 5}, .path = {}}};
      scene.lights.push_back(scenes::directional_light({-1, -2, -0.5}));
      Material material = bumped(0.05 * factor);
      material.reflection = 0.5;
      add(scene, Sphere{{0, 0, 0}, factor}, material);
      return scenes::render(scene).image.rgb;
    };
    EXPECT_EQ(at_scale(1), at_scale(k)) << exponent;
  }
}

TEST(Bump, HasNoEffectIfTheTextureIsConstant) {
  Scene scene = scenes::random(7, 24);
  const auto plain = scenes::render(scene);
  scene.textures.push_back(constant({0.5, 0.5, 0.5}));
  const TextureId last{static_cast<std::uint32_t>(scene.textures.size() - 1)};
  for (Material& material : scene.materials) material.bump = Bump{last, 3};
  EXPECT_EQ(scenes::render(scene).image.rgb, plain.image.rgb);
}

TEST(NormalMap, OfOneColourIsTheTiltedNormal) {
  for (const Vec3& n : {Vec3{0, 0, 1}, normalize({0.3, -0.2, 1}), normalize({-0.8, 0.1, 0.5})})
    // u along x, v along -z, out along y
    expect_normal(scene_of(level_plane, mapped(), direction(n)), {n.x, n.z, -n.y});
}

TEST(NormalMap, FollowsCoordinatesThatAreTurnedMirroredAndSheared) {
  const Vec3 n = normalize({0.4, 0.2, 1});
  const auto with = [&](const std::array<Vec2, 3>& uvs) {
    return scene_of(Triangle{{Vec3{-4, 0, 4}, {4, 0, 4}, {0, 0, -4}}, {}, uvs}, mapped(), direction(n));
  };
  expect_normal(with({{{4, -4}, {4, 4}, {-4, 0}}}), {n.y, n.z, n.x});     // u = z, v = x
  expect_normal(with({{{4, -4}, {-4, -4}, {0, 4}}}), {-n.x, n.z, -n.y});  // u = -x, v = -z
  // u = x + z, v = z: with v still, one moves along x; with u still, along z - x.
  const double half = std::sqrt(0.5);
  expect_normal(with({{{0, 4}, {8, 4}, {-4, -4}}}), {n.x - n.y * half, n.z, n.y * half});
}

TEST(NormalMap, IsMirroredOnTheBackSide) {
  const Vec3 n = normalize({0.4, 0.2, 1});
  expect_normal(scene_of(Plane{{0, 0, 0}, {0, -1, 0}, {}}, mapped(), direction(n)), -Vec3{n.x, -n.z, n.y});
}

TEST(NormalMap, IsPerturbedFurtherByABump) {
  Material material = mapped();
  material.bump = Bump{{1}, 0.5};
  Scene scene = scene_of(level_plane, material, direction({0, 0, 1}));
  scene.textures.push_back(rising());
  expect_normal(scene, {0, 1, 0.5});
}

TEST(NormalMap, IsLinearWithoutAnExplicitColorSpace) {
  const auto png = encode({1, 1, {0.5F, 0.25F, 0.75F}}, Format::png);  // sRGB codes 188, 137, 225
  ASSERT_TRUE(png);
  const auto lit = [&](std::optional<ColorSpace> space, bool also_a_color) {
    Scene scene = scene_of(level_plane, mapped(), {.pattern = ImageTexture{{0}, space}, .path = {}}, {0, 1, 0});
    scene.assets.push_back({"normals.png", "/textures/normals/file"});
    if (also_a_color) scene.materials[0].color = TextureId{0};
    return scenes::render(scene, 1, {{png->bytes}}).image.rgb[0];
  };
  const Vec3 linear = normalize({2 * 188 / 255.0 - 1, 2 * 137 / 255.0 - 1, 2 * 225 / 255.0 - 1});
  EXPECT_NEAR(lit(std::nullopt, false), linear.z, 1e-6);
  EXPECT_NEAR(lit(ColorSpace::linear, false), linear.z, 1e-6);
  EXPECT_NEAR(lit(std::nullopt, true), 0.5028865 * linear.z, 1e-4) << "the colour stays sRGB: code 188";
  const Vec3 decoded = normalize({2 * 0.5028865 - 1, 2 * 0.2501583 - 1, 2 * 0.7529422 - 1});
  EXPECT_NEAR(lit(ColorSpace::srgb, false), decoded.z, 1e-4);
}

TEST(PerturbedNormals, TransmitNoLightFromBehind) {
  // The light is below the disc; the normal leans so far that it would face the light.
  Scene scene =
      scene_of(Disc{{0, 0, 0}, {0, 1, 0}, 2, 0, {}}, mapped(), direction(normalize({1, 0, 0.05})), {1, -0.1, 0});
  EXPECT_EQ(brightness(scene), 0);
  scene.lights[0] = scenes::directional_light(-normalize({1, 0.1, 0}));
  EXPECT_GT(brightness(scene), 0.9);
}

TEST(NormalMap, TiltsPrincipledSurfacesLikeTheirFaces) {
  Material metal = mapped();
  metal.model = Material::Model::principled;
  metal.metallic = metal.roughness = Color{0.6, 0.6, 0.6};
  const Vec3 normal = normalize({0.3, 1, 0.2});
  const Texture tilted = direction({normal.x, -normal.z, normal.y});
  const double found = brightness(scene_of(level_plane, metal, tilted));
  metal.normal_map.reset();
  EXPECT_NEAR(found, brightness(scene_of(Plane{{0, 0, 0}, normal, {}}, metal, tilted)), 1e-6);
  EXPECT_GT(std::abs(found - brightness(scene_of(level_plane, metal, tilted))), 0.05);
}

/// A shape with normals that lean every way, under a white sky.
Scene with_wild_normals(const Shape& shape, Material material) {
  Scene scene = scenes::empty(32, {.position = {0, 0.3, 4}, .look_at = {0, 0, 0}, .fov_deg = 20});
  scene.textures = {{.pattern = NoiseTexture{{Color{0, 0, 0.5}, Color{1, 1, 0.6}}, 4}, .scale = {40, 40}, .path = {}}};
  scene.textures[0].filter = Texture::Filter::nearest;
  scene.background.color = {1, 1, 1};
  material.normal_map = TextureId{0};
  add(scene, shape, material);
  return scene;
}

TEST(PerturbedNormals, KeepReflectedRaysAboveTheSurface) {
  Scene scene = with_wild_normals(level_plane, scenes::mirror());
  add(scene, Disc{{0, -0.01, 0}, {0, 1, 0}, 99, 0, {}}, scenes::matte({0, 0, 0}));  // every reflection sees the sky
  for (const float channel : scenes::render(scene).image.rgb) EXPECT_EQ(channel, 1);
}

TEST(PerturbedNormals, KeepRefractedRaysOnTheirSide) {
  const Scene scene = with_wild_normals(Disc{{0, 0, 0}, {0, 1, 0}, 9, 0, {}}, scenes::glass());
  const Rendered rendered = scenes::render(scene);
  EXPECT_EQ(rendered.statistics.non_finite, 0u);
  for (const float channel : rendered.image.rgb) EXPECT_NEAR(channel, 1, 1e-5);  // F + (1 - F), whatever the normals
}

TEST(PerturbedNormals, AreRequiredOnlyByMaterialsThatObjectsHave) {
  Scene scene = scene_of(level_plane, bumped(1), rising(), {0, 1, 0});
  EXPECT_TRUE(requirements(scene).bump && requirements(scene).textures && requirements(scene).filtered_textures);
  scene.textures[0].filter = Texture::Filter::nearest;
  EXPECT_FALSE(requirements(scene).filtered_textures);
  scene.materials.push_back(scenes::matte({1, 1, 1}));
  scene.objects[0].material = {1};
  EXPECT_FALSE(requirements(scene).bump || requirements(scene).textures);
}

}  // namespace
