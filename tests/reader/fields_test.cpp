/// What each field of a document becomes: the value written, and the default where nothing is written.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <variant>

#include "tests/reader/reading.h"

namespace {

using reader_tests::accepted;
using reader_tests::document_with;
using reader_tests::document_with_object;
using tracer::Color;
using tracer::Vec2;
using tracer::Vec3;

tracer::Scene every_field() {
  return accepted(reader_tests::file_bytes(WHITTLE_SOURCE_DIR "/tests/reader/every_field.json")).scene;
}

tracer::Material material_of(const std::string& members) {
  const auto document = accepted(document_with(R"("materials": {"m": {)" + members + "}}"));
  return document.scene.materials.empty() ? tracer::Material{} : document.scene.materials[0];
}

Color ambient_of(const std::string& color) { return accepted(document_with(R"("ambient": )" + color)).scene.ambient; }

void expect_near(const Color& seen, const Color& expected) {
  EXPECT_NEAR(seen.r, expected.r, 1e-12);
  EXPECT_NEAR(seen.g, expected.g, 1e-12);
  EXPECT_NEAR(seen.b, expected.b, 1e-12);
}

TEST(Defaults, AreThoseOfTheSceneHeader) {
  const tracer::Scene scene = accepted(document_with()).scene;
  const tracer::Scene expected;
  EXPECT_EQ(scene.name, "");
  EXPECT_EQ(scene.image.width, 640u);
  EXPECT_EQ(scene.image.height, 480u);
  EXPECT_EQ(scene.camera.up, (Vec3{0, 1, 0}));
  EXPECT_EQ(scene.camera.fov_deg, 45);
  EXPECT_EQ(scene.background.color, Color{});
  EXPECT_EQ(scene.ambient, Color{});
  EXPECT_TRUE(scene.lights.empty() && scene.textures.empty() && scene.materials.empty() && scene.objects.empty());
  EXPECT_EQ(scene.accuracy.samples, expected.accuracy.samples);
  EXPECT_EQ(scene.accuracy.max_depth, expected.accuracy.max_depth);
  EXPECT_EQ(scene.accuracy.cutoff, expected.accuracy.cutoff);
  EXPECT_EQ(scene.accuracy.seed, 0u);
  EXPECT_EQ(scene.output.formats, std::vector{tracer::Format::png});
}

TEST(Defaults, OfAJobAreMiddlePriorityAndThreeAttempts) {
  const api::JobRequest job = accepted(document_with()).job;
  EXPECT_EQ(job.priority, 50);
  EXPECT_EQ(job.max_attempts, 3);
  EXPECT_TRUE(job.labels.empty());
}

TEST(Defaults, OfALightAreWhiteShadowsAndNoAttenuation) {
  const auto scene = accepted(document_with(R"("lights": [{"type": "point", "position": [1, 2, 3]}])")).scene;
  ASSERT_EQ(scene.lights.size(), 1u);
  const tracer::Light& light = scene.lights[0];
  EXPECT_EQ(light.color, (Color{1, 1, 1}));
  EXPECT_EQ(light.intensity, 1);
  EXPECT_TRUE(light.shadows);
  EXPECT_EQ(light.attenuation.kind, tracer::Attenuation::Kind::none);
}

TEST(Defaults, OfAMaterialAreThoseOfTheSceneHeader) {
  const tracer::Material seen = material_of("");
  EXPECT_EQ(seen.model, tracer::Material::Model::phong);
  EXPECT_EQ(std::get<Color>(seen.color), (Color{0.8, 0.8, 0.8}));
  EXPECT_EQ(seen.ambient, 1);
  EXPECT_EQ(seen.diffuse, 1);
  EXPECT_EQ(seen.specular, 0);
  EXPECT_EQ(seen.shininess, 32);
  EXPECT_EQ(seen.specular_color, (Color{1, 1, 1}));
  EXPECT_EQ(seen.emission, Color{});
  EXPECT_EQ(seen.reflection, 0);
  EXPECT_EQ(seen.reflection_color, (Color{1, 1, 1}));
  EXPECT_EQ(seen.transmission, 0);
  EXPECT_EQ(seen.transmission_color, (Color{1, 1, 1}));
  EXPECT_EQ(seen.ior, 1.5);
  EXPECT_FALSE(seen.fresnel);
  EXPECT_EQ(seen.path, "/materials/m");
}

TEST(Defaults, OfShapesAreTheirConventionalAxes) {
  const auto sphere = accepted(document_with_object("sphere", R"("center": [0,0,0], "radius": 1)")).scene;
  ASSERT_EQ(sphere.objects.size(), 1u);
  EXPECT_EQ(std::get<tracer::Sphere>(sphere.objects[0].shape).axis, (Vec3{0, 1, 0}));
  EXPECT_EQ(std::get<tracer::Sphere>(sphere.objects[0].shape).meridian, (Vec3{1, 0, 0}));
  const auto plane = accepted(document_with_object("plane", R"("point": [0,0,0], "normal": [0,1,0])")).scene;
  ASSERT_EQ(plane.objects.size(), 1u);
  EXPECT_FALSE(std::get<tracer::Plane>(plane.objects[0].shape).u_axis);
  const auto triangle = accepted(document_with_object("triangle", R"("vertices": [[0,0,0],[1,0,0],[0,1,0]])")).scene;
  ASSERT_EQ(triangle.objects.size(), 1u);
  EXPECT_FALSE(std::get<tracer::Triangle>(triangle.objects[0].shape).normals);
  EXPECT_FALSE(std::get<tracer::Triangle>(triangle.objects[0].shape).uvs);
  const auto mesh =
      accepted(document_with_object("mesh", R"("positions": [[0,0,0],[1,0,0],[0,1,0]], "triangles": [[0,1,2]])")).scene;
  ASSERT_EQ(mesh.objects.size(), 1u);
  EXPECT_FALSE(std::get<tracer::Mesh>(mesh.objects[0].shape).smooth);
  EXPECT_TRUE(std::get<tracer::Mesh>(mesh.objects[0].shape).normals.empty());
  EXPECT_TRUE(std::get<tracer::Mesh>(mesh.objects[0].shape).uvs.empty());
}

TEST(EveryField, OfImageCameraAndBackgroundIsRead) {
  const tracer::Scene scene = every_field();
  EXPECT_EQ(scene.name, "every field");
  EXPECT_EQ(scene.image.width, 32u);
  EXPECT_EQ(scene.image.height, 16u);
  EXPECT_EQ(scene.camera.position, (Vec3{1, 2, 3}));
  EXPECT_EQ(scene.camera.look_at, (Vec3{4, 5, 7}));
  EXPECT_EQ(scene.camera.up, (Vec3{0, 0, 1}));
  EXPECT_EQ(scene.camera.fov_deg, 30);
  EXPECT_EQ(scene.background.color, (Color{0.25, 0.5, 2}));
  EXPECT_EQ(scene.ambient, (Color{0.125, 0.125, 0.125}));
}

TEST(EveryField, OfLightsIsRead) {
  const tracer::Scene scene = every_field();
  ASSERT_EQ(scene.lights.size(), 2u);
  const tracer::Light& point = scene.lights[0];
  EXPECT_EQ(std::get<tracer::PointLight>(point.source).position, (Vec3{5, 6, 7}));
  EXPECT_EQ(point.color, (Color{1, 0, 0}));
  EXPECT_EQ(point.intensity, 3);
  EXPECT_FALSE(point.shadows);
  EXPECT_EQ(point.attenuation.kind, tracer::Attenuation::Kind::polynomial);
  EXPECT_EQ(point.attenuation.coefficients, (std::array{1.0, 0.5, 0.25}));
  const tracer::Light& directional = scene.lights[1];
  EXPECT_EQ(std::get<tracer::DirectionalLight>(directional.source).direction, (Vec3{1, -2, 3}));
  EXPECT_EQ(directional.color, (Color{0.5, 0.25, 0.125}));
  EXPECT_EQ(directional.intensity, 4);
  EXPECT_FALSE(directional.shadows);
  EXPECT_EQ(directional.attenuation.kind, tracer::Attenuation::Kind::inverse_square);
}

TEST(EveryField, OfTexturesAndMaterialsIsRead) {
  const tracer::Scene scene = every_field();
  ASSERT_EQ(scene.textures.size(), 6u);
  EXPECT_EQ(std::get<tracer::CheckerTexture>(scene.textures[0].pattern).colors, (std::array{Color{}, Color{1, 2, 3}}));
  EXPECT_EQ(scene.textures[0].scale, (Vec2{2, 4}));
  EXPECT_EQ(scene.textures[0].offset, (Vec2{0.5, 0.25}));
  EXPECT_EQ(scene.textures[0].path, "/textures/floor");
  EXPECT_EQ(scene.textures[5].path, "/objects/2/material/color");
  ASSERT_EQ(scene.materials.size(), 3u);
  const tracer::Material& glass = scene.materials[0];
  EXPECT_EQ(glass.model, tracer::Material::Model::blinn_phong);
  EXPECT_EQ(std::get<tracer::TextureId>(glass.color).index, 0u);
  EXPECT_EQ(glass.ambient, 0.5);
  EXPECT_EQ(glass.diffuse, 0.25);
  EXPECT_EQ(glass.specular, 0.75);
  EXPECT_EQ(glass.shininess, 8);
  EXPECT_EQ(glass.specular_color, (Color{0.5, 0.5, 0.5}));
  EXPECT_EQ(glass.emission, (Color{1, 2, 3}));
  EXPECT_EQ(glass.reflection, 0.375);
  EXPECT_EQ(glass.reflection_color, (Color{0.25, 0.25, 0.25}));
  EXPECT_EQ(glass.transmission, 0.625);
  EXPECT_EQ(glass.transmission_color, (Color{0.5, 0.25, 1}));
  EXPECT_EQ(glass.ior, 1.25);
  EXPECT_FALSE(glass.fresnel);
  EXPECT_EQ(std::get<tracer::TextureId>(scene.materials[2].color).index, 5u);
}

TEST(EveryField, OfPatternsAndPicturesIsRead) {
  using tracer::Texture;
  const tracer::Scene scene = every_field();
  ASSERT_EQ(scene.textures.size(), 6u);
  const Texture& sky = scene.textures[1];
  EXPECT_EQ(std::get<tracer::GradientTexture>(sky.pattern).colors, (std::array{Color{1, 1, 1}, Color{0.25, 0.5, 2}}));
  EXPECT_EQ(sky.wrap, Texture::Wrap::mirror);
  EXPECT_EQ(sky.filter, Texture::Filter::nearest);
  const Texture& marble = scene.textures[2];
  EXPECT_EQ(std::get<tracer::NoiseTexture>(marble.pattern).colors, (std::array{Color{0.5, 0.5, 0.5}, Color{1, 1, 1}}));
  EXPECT_EQ(std::get<tracer::NoiseTexture>(marble.pattern).octaves, 5u);
  EXPECT_EQ(marble.wrap, Texture::Wrap::clamp);
  EXPECT_EQ(marble.filter, Texture::Filter::bilinear);
  const auto& wood = std::get<tracer::ImageTexture>(scene.textures[3].pattern);
  EXPECT_EQ(wood.color_space, tracer::ColorSpace::linear);
  EXPECT_EQ(scene.textures[3].wrap, Texture::Wrap::repeat);
  EXPECT_EQ(scene.textures[3].filter, Texture::Filter::mipmap);
  const auto& oak = std::get<tracer::ImageTexture>(scene.textures[4].pattern);
  EXPECT_FALSE(oak.color_space);
  EXPECT_EQ(oak.file, wood.file) << "a file named twice is one asset";
  ASSERT_EQ(scene.assets.size(), 1u);
  EXPECT_EQ(scene.assets[0].name, "assets/wood.png");
  EXPECT_EQ(scene.assets[0].path, "/textures/wood/file");
}

TEST(EveryField, OfSpheresPlanesAndTrianglesIsRead) {
  const tracer::Scene scene = every_field();
  ASSERT_EQ(scene.objects.size(), 5u);
  const auto& sphere = std::get<tracer::Sphere>(scene.objects[0].shape);
  EXPECT_EQ(sphere.center, (Vec3{1, 2, 3}));
  EXPECT_EQ(sphere.radius, 4);
  EXPECT_EQ(sphere.axis, (Vec3{0, 0, 2}));
  EXPECT_EQ(sphere.meridian, (Vec3{0, 1, 0}));
  const auto& plane = std::get<tracer::Plane>(scene.objects[1].shape);
  EXPECT_EQ(plane.point, (Vec3{1, 2, 3}));
  EXPECT_EQ(plane.normal, (Vec3{0, 0, 1}));
  EXPECT_EQ(plane.u_axis, (Vec3{0, 1, 0}));
  const auto& triangle = std::get<tracer::Triangle>(scene.objects[2].shape);
  EXPECT_EQ(triangle.vertices, (std::array{Vec3{0, 0, 1}, Vec3{2, 0, 1}, Vec3{0, 3, 1}}));
  ASSERT_TRUE(triangle.normals && triangle.uvs);
  EXPECT_EQ(*triangle.normals, (std::array{Vec3{0, 0, 1}, Vec3{0, 1, 1}, Vec3{1, 0, 1}}));
  EXPECT_EQ(*triangle.uvs, (std::array{Vec2{0, 0}, Vec2{2, 0}, Vec2{0, 3}}));
  EXPECT_EQ(scene.objects[0].material.index, 0u);
  EXPECT_EQ(scene.objects[1].material.index, 1u);
  EXPECT_EQ(scene.objects[2].material.index, 2u);
  EXPECT_EQ(scene.objects[4].material.index, 0u);
}

TEST(EveryField, OfMeshesIsRead) {
  const tracer::Scene scene = every_field();
  ASSERT_EQ(scene.objects.size(), 5u);
  const auto& mesh = std::get<tracer::Mesh>(scene.objects[3].shape);
  EXPECT_EQ(mesh.positions, (std::vector{Vec3{}, Vec3{1, 0, 0}, Vec3{0, 1, 0}}));
  EXPECT_EQ(mesh.triangles, (std::vector{std::array{2u, 0u, 1u}}));
  EXPECT_EQ(mesh.normals, (std::vector{Vec3{0, 0, 1}, Vec3{0, 0, 2}, Vec3{0, 0, 3}}));
  EXPECT_EQ(mesh.uvs, (std::vector{Vec2{0, 0}, Vec2{1, 0}, Vec2{0, 1}}));
  EXPECT_TRUE(mesh.smooth);
  const auto& faces = std::get<tracer::Mesh>(scene.objects[4].shape);
  EXPECT_EQ(faces.triangles, (std::vector{std::array{0u, 1u, 2u}, std::array{0u, 2u, 3u}}));
}

TEST(EveryField, OfAccuracyOutputAndJobIsRead) {
  const auto document = accepted(reader_tests::file_bytes(WHITTLE_SOURCE_DIR "/tests/reader/every_field.json"));
  EXPECT_EQ(document.scene.accuracy.samples, 9u);
  EXPECT_EQ(document.scene.accuracy.max_depth, 5u);
  EXPECT_EQ(document.scene.accuracy.cutoff, 0.5);
  EXPECT_EQ(document.scene.accuracy.seed, 9007199254740991u);
  EXPECT_EQ(document.scene.output.formats, (std::vector{tracer::Format::exr, tracer::Format::png}));
  EXPECT_EQ(document.job.name, "a job");
  EXPECT_EQ(document.job.labels, (std::map<std::string, std::string>{{"", "x"}, {"team", "blue"}}));
  EXPECT_EQ(document.job.priority, 70);
  EXPECT_EQ(document.job.max_attempts, 5);
}

TEST(Job, IsNamedAfterTheSceneWhenItHasNoName) {
  EXPECT_EQ(accepted(document_with(R"("name": "s")")).job.name, "s");
  EXPECT_EQ(accepted(document_with(R"("name": "s", "job": {"name": "j"})")).job.name, "j");
}

TEST(Colors, AreReadInAllFourForms) {
  EXPECT_EQ(ambient_of("[0.5, 2, 0]"), (Color{0.5, 2, 0}));
  EXPECT_EQ(ambient_of("3"), (Color{3, 3, 3}));
  EXPECT_EQ(ambient_of(R"("#FF00ff")"), (Color{1, 0, 1}));
  expect_near(ambient_of(R"({"hsb": [0, 1, 1]})"), {1, 0, 0});
}

TEST(Colors, AsTextAreDecodedFromSrgb) {
  // IEC 61966-2-1 at both branches: 10/255 is on the straight part, 0xBC encodes about one half.
  expect_near(ambient_of(R"("#0a0a0a")"), {10 / 255.0 / 12.92, 10 / 255.0 / 12.92, 10 / 255.0 / 12.92});
  EXPECT_NEAR(ambient_of(R"("#bc0000")").r, 0.5028864580325687, 1e-12);
  EXPECT_NEAR(ambient_of(R"("#c03020")").g, 0.0295568344378088, 1e-12);
}

TEST(Colors, AsHueSaturationBrightnessGoThroughSrgb) {
  expect_near(ambient_of(R"({"hsb": [120, 1, 1]})"), {0, 1, 0});
  expect_near(ambient_of(R"({"hsb": [240, 1, 1]})"), {0, 0, 1});
  expect_near(ambient_of(R"({"hsb": [60, 1, 1]})"), {1, 1, 0});
  const double half = std::pow((0.5 + 0.055) / 1.055, 2.4);
  expect_near(ambient_of(R"({"hsb": [200, 0, 0.5]})"), {half, half, half});
  expect_near(ambient_of(R"({"hsb": [0, 0.5, 1]})"), {1, half, half});
  expect_near(ambient_of(R"({"hsb": [30, 1, 1]})"), {1, half, 0});
}

TEST(Colors, HaveHuesThatGoRound) {
  expect_near(ambient_of(R"({"hsb": [-120, 1, 1]})"), {0, 0, 1});
  expect_near(ambient_of(R"({"hsb": [480, 1, 1]})"), {0, 1, 0});
  expect_near(ambient_of(R"({"hsb": [360, 1, 1]})"), {1, 0, 0});
}

TEST(Materials, ThatTransmitReflectByFresnelUnlessToldOtherwise) {
  const tracer::Material glass = material_of(R"("transmission": 0.5)");
  EXPECT_TRUE(glass.fresnel);
  EXPECT_EQ(glass.reflection, 1);
  const tracer::Material dull = material_of(R"("transmission": 0.5, "reflection": 0.25)");
  EXPECT_TRUE(dull.fresnel);
  EXPECT_EQ(dull.reflection, 0.25);
  const tracer::Material plain = material_of(R"("fresnel": false, "transmission": 0.5)");
  EXPECT_FALSE(plain.fresnel);
  EXPECT_EQ(plain.reflection, 0);
  const tracer::Material lacquer = material_of(R"("fresnel": true)");
  EXPECT_TRUE(lacquer.fresnel);
  EXPECT_EQ(lacquer.reflection, 1);
}

TEST(Materials, AreTakenByNameWhereverTheDocumentDefinesThem) {
  const auto scene =
      accepted(document_with(
                   R"("objects": [{"type": "plane", "point": [0,0,0], "normal": [0,1,0], "material": "b"}],
                                  "materials": {"a": {}, "b": {"color": "t"}}, "textures": {"t": {"checker": [0,1]}})"))
          .scene;
  ASSERT_EQ(scene.objects.size(), 1u);
  EXPECT_EQ(scene.materials[scene.objects[0].material.index].path, "/materials/b");
}

TEST(Spheres, TurnTheirDefaultMeridianWhenTheAxisIsAlongIt) {
  const auto scene =
      accepted(document_with_object("sphere", R"("center": [0,0,0], "radius": 1, "axis": [-2,0,0])")).scene;
  ASSERT_EQ(scene.objects.size(), 1u);
  EXPECT_EQ(std::get<tracer::Sphere>(scene.objects[0].shape).meridian, (Vec3{0, 0, 1}));
}

TEST(Integers, MayBeSpeltAsAnyNumberWithoutAFraction) {
  for (const char* text : {"40", "40.0", "4e1", "400E-1", "4.0e+1"}) {
    const auto scene = accepted(document_with(R"("image": {"width": )" + std::string(text) + "}")).scene;
    EXPECT_EQ(scene.image.width, 40u) << text;
  }
}

}  // namespace
