/// Values that are read. The tables of fields name their members (tests/reader/schema_test.py). Default values of
/// fields without a table (the others are those of the members, which api/docs/scene.md states and tests/docs
/// compares), defaults that depend on other fields, and the four forms of a color.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <variant>

#include "tests/reader/reading.h"

namespace {

using namespace reader_tests;
using tracer::Color;
using tracer::Vec2;
using tracer::Vec3;

tracer::Scene scene_of(const std::string& file) {
  return accepted(file_bytes(WHITTLE_SOURCE_DIR "/tests/reader/" + file)).scene;
}

/// A scene with an object of every shape, a light of every kind, patterns and an image.
const tracer::Scene& every_field() {
  static const tracer::Scene scene = scene_of("every_field.json");
  return scene;
}

TEST(SceneReader, ReadsFieldsOfEveryKind) {
  const tracer::Scene& scene = every_field();
  const tracer::Material& glass = scene.materials.at(0);
  EXPECT_EQ(scene.name, "every field");
  EXPECT_EQ(scene.image.width, 32u);
  EXPECT_EQ(scene.image.height, 16u);
  EXPECT_EQ(scene.camera.position, (Vec3{1, 2, 3}));
  EXPECT_EQ(scene.camera.fov_deg, 30);
  EXPECT_EQ(scene.background.color, (Color{0.25, 0.5, 2}));
  EXPECT_EQ(scene.ambient, (Color{0.125, 0.125, 0.125}));
  EXPECT_EQ(scene.medium.absorption, (Color{0.5, 0, 0.25}));
  EXPECT_EQ(scene.textures.at(0).offset, (Vec2{0.5, 0.25}));
  EXPECT_EQ(glass.model, tracer::Material::Model::blinn_phong);
  EXPECT_EQ(std::get<tracer::TextureId>(glass.color).index, 0u);
  EXPECT_EQ(std::get<Color>(glass.opacity), (Color{0.5, 1, 0.75}));
  EXPECT_EQ(glass.reflection, 0.375);
  EXPECT_FALSE(glass.fresnel);
  EXPECT_EQ(glass.priority, -3);
  EXPECT_EQ(glass.path, "/materials/glass");
}

TEST(SceneReader, ReadsCropGradientDepthCueAndOutput) {
  using enum tracer::Format;
  const tracer::Scene scene = scene_of("every_field_of_images.json");
  EXPECT_EQ(scene.image.crop, (tracer::PixelWindow{3, 2, 20, 10}));
  EXPECT_EQ(scene.camera.height, 6);
  EXPECT_EQ(scene.camera.focus_distance, 3);
  ASSERT_TRUE(scene.background.gradient && scene.depth_cue);
  EXPECT_EQ(scene.background.gradient->zenith, (Color{0, 0.5, 1}));
  EXPECT_EQ(scene.background.gradient->nadir, (Color{0.25, 0.25, 0.25}));
  EXPECT_EQ(scene.background.up, (Vec3{0, 0, 2}));
  EXPECT_EQ(scene.depth_cue->front_scale, 0.75);
  EXPECT_EQ(scene.output.formats, (std::vector{png16, jpg, tiff, hdr, exr, webp, png}));
}

tracer::Camera camera_with(const std::string& fields) {
  return accepted(R"({"version": 1, "camera": {"position": [0, 1, 6], "look_at": [0, 0, 0])" + fields + "}}")
      .scene.camera;
}

TEST(SceneReader, ReadsStereoPairs) {
  using Layout = tracer::Camera::Layout;
  EXPECT_EQ(camera_with("").layout, Layout::single);
  EXPECT_EQ(camera_with("").eye_separation, 0);
  EXPECT_EQ(camera_with(R"(, "eye_separation": 0)").layout, Layout::single);
  EXPECT_EQ(camera_with(R"(, "eye_separation": 0.25)").layout, Layout::side_by_side);
  EXPECT_EQ(camera_with(R"(, "eye_separation": 0.25)").eye_separation, 0.25);
  EXPECT_EQ(camera_with(R"(, "layout": "side_by_side")").layout, Layout::side_by_side);
  const tracer::Camera anaglyph = scene_of("every_field_of_cubes.json").camera;
  EXPECT_EQ(anaglyph.layout, Layout::anaglyph);
  EXPECT_EQ(anaglyph.eye_separation, 0.25);
}

TEST(SceneReader, AcceptsCameraFieldsOfOtherTypes) {
  EXPECT_EQ(camera_with(R"(, "type": "panorama", "fov": 30, "height": 2)").type, tracer::Camera::Type::panorama);
  EXPECT_FALSE(camera_with(R"(, "type": "panorama")").focus_distance);
}

TEST(SceneReader, ReadsLightsAndTargetsOfSpots) {
  const auto& lights = every_field().lights;
  ASSERT_EQ(lights.size(), 8u);
  EXPECT_EQ(std::get<tracer::PointLight>(lights[0].source).position, (Vec3{5, 6, 7}));
  EXPECT_EQ(lights[0].color, (Color{1, 0, 0}));
  EXPECT_EQ(lights[0].attenuation.kind, tracer::Attenuation::Kind::polynomial);
  EXPECT_EQ(lights[0].attenuation.coefficients, (std::array{1.0, 0.5, 0.25}));
  EXPECT_EQ(lights[1].attenuation.kind, tracer::Attenuation::Kind::inverse_square);
  EXPECT_EQ(std::get<tracer::SphereLight>(lights[7].source).radius, 3.5);
  EXPECT_EQ(std::get<tracer::SpotLight>(lights[2].source).direction, (Vec3{0, -2, 1}));
  const auto& targeted = std::get<tracer::SpotLight>(lights[3].source);
  EXPECT_EQ(targeted.direction, (Vec3{1, 2, 4}));
  EXPECT_EQ(targeted.outer_angle_deg, 180);
}

TEST(SceneReader, ReadsPatternsAndImages) {
  const tracer::Scene& scene = every_field();
  ASSERT_EQ(scene.textures.size(), 6u);
  EXPECT_EQ(std::get<tracer::CheckerTexture>(scene.textures[0].pattern).colors, (std::array{Color{}, Color{1, 2, 3}}));
  EXPECT_EQ(scene.textures[0].path, "/textures/floor");
  EXPECT_TRUE(std::holds_alternative<tracer::GradientTexture>(scene.textures[1].pattern));
  EXPECT_EQ(std::get<tracer::NoiseTexture>(scene.textures[2].pattern).octaves, 5u);
  const auto& wood = std::get<tracer::ImageTexture>(scene.textures[3].pattern);
  EXPECT_EQ(wood.color_space, tracer::ColorSpace::linear);
  const auto& oak = std::get<tracer::ImageTexture>(scene.textures[4].pattern);
  EXPECT_FALSE(oak.color_space);
  EXPECT_EQ(oak.file, wood.file) << "a file named twice is one asset";
  ASSERT_EQ(scene.assets.size(), 1u);
  EXPECT_EQ(scene.assets[0].name, "assets/wood.png");
  EXPECT_EQ(scene.assets[0].path, "/textures/wood/file");
  EXPECT_EQ(scene.textures[5].path, "/objects/2/material/color");
  ASSERT_EQ(scene.materials.size(), 4u);
  EXPECT_EQ(std::get<tracer::TextureId>(scene.materials[3].color).index, 5u);
  EXPECT_EQ(std::get<tracer::TextureId>(scene.materials[2].roughness).index, 2u);
  EXPECT_EQ(scene.materials[2].specular, 1);
}

TEST(SceneReader, ReadsObjectsAndTheirMaterials) {
  const tracer::Scene& scene = every_field();
  ASSERT_EQ(scene.objects.size(), 12u);
  const auto& triangle = std::get<tracer::Triangle>(scene.objects[2].shape);
  EXPECT_EQ(triangle.vertices, (std::array{Vec3{0, 0, 1}, Vec3{2, 0, 1}, Vec3{0, 3, 1}}));
  ASSERT_TRUE(triangle.normals && triangle.uvs);
  EXPECT_EQ(*triangle.uvs, (std::array{Vec2{0, 0}, Vec2{2, 0}, Vec2{0, 3}}));
  EXPECT_FALSE(std::get<tracer::Cone>(scene.objects[7].shape).caps);
  for (const auto& [object, material] : {std::pair{0u, 0u}, {1u, 2u}, {2u, 3u}, {4u, 0u}})
    EXPECT_EQ(scene.objects[object].material.index, material) << object;
}

TEST(SceneReader, ReadsMeshes) {
  const auto& mesh = std::get<tracer::Mesh>(every_field().objects.at(3).shape);
  EXPECT_EQ(mesh.positions, (std::vector{Vec3{}, Vec3{1, 0, 0}, Vec3{0, 1, 0}}));
  EXPECT_EQ(mesh.triangles, (std::vector{std::array{2u, 0u, 1u}}));
  EXPECT_EQ(mesh.normals, (std::vector{Vec3{0, 0, 1}, Vec3{0, 0, 2}, Vec3{0, 0, 3}}));
  EXPECT_EQ(mesh.uvs, (std::vector{Vec2{0, 0}, Vec2{1, 0}, Vec2{0, 1}}));
  EXPECT_TRUE(mesh.smooth);
  const auto& faces = std::get<tracer::Mesh>(every_field().objects.at(4).shape);
  EXPECT_EQ(faces.triangles, (std::vector{std::array{0u, 1u, 2u}, std::array{0u, 2u, 3u}}));
}

TEST(SceneReader, ReadsInstancesBeforeAndAfterTheirPrototypes) {
  const tracer::Scene& scene = every_field();
  ASSERT_EQ(scene.prototypes.size(), 2u);
  EXPECT_EQ(scene.prototypes[0].path, "/prototypes/pair");
  ASSERT_EQ(scene.prototypes[0].objects.size(), 2u);
  EXPECT_EQ(std::get<tracer::Instance>(scene.prototypes[0].objects[1].shape).of.index, 1u);
  EXPECT_TRUE(std::holds_alternative<tracer::Sphere>(scene.prototypes[1].objects.at(0).shape));
  const auto& whole = std::get<tracer::Instance>(scene.objects.at(9).shape);
  EXPECT_EQ(whole.of.index, 0u);
  EXPECT_EQ(whole.material.value_or(tracer::MaterialId{9}).index, 0u);
  const tracer::Object& plain = scene.objects.at(10);
  EXPECT_EQ(std::get<tracer::Instance>(plain.shape).of.index, 1u);
  EXPECT_FALSE(std::get<tracer::Instance>(plain.shape).material || plain.transform);
}

TEST(SceneReader, ReadsTransformsAsMatrixOrSteps) {
  const auto& objects = every_field().objects;
  ASSERT_EQ(objects.size(), 12u);
  // (x, y, z) moved, turned a quarter about z, scaled: 2(-(y + 2)), 3(x + 1), 4(z + 3).
  const tracer::Transform steps{{{{0, -2, 0, -4}, {3, 0, 0, 3}, {0, 0, 4, 12}}}};
  EXPECT_EQ(objects[0].transform, steps);
  const tracer::Transform matrix{{{{1, 2, 3, 4}, {0, 1, 5, 6}, {0, 0, 1, 7}}}};
  EXPECT_EQ(objects[1].transform, matrix);
  const tracer::Transform twice{{{{2, 0, 0, 0}, {0, 2, 0, 0}, {0, 0, 2, 0}}}};
  for (const std::size_t i : {2, 3, 5, 6, 7, 8, 9}) EXPECT_EQ(objects[i].transform, twice) << i;
}

TEST(SceneReader, ReadsAccuracyOutputAndJob) {
  const auto document = accepted(file_bytes(WHITTLE_SOURCE_DIR "/tests/reader/every_field.json"));
  EXPECT_EQ(document.scene.accuracy.samples, 9u);
  EXPECT_EQ(document.scene.accuracy.max_depth, 5u);
  EXPECT_EQ(document.scene.accuracy.cutoff, 0.5);
  EXPECT_EQ(document.scene.accuracy.seed, 9007199254740991u);
  EXPECT_EQ(document.scene.output.formats, (std::vector{tracer::Format::exr, tracer::Format::png}));
  EXPECT_EQ(document.job.name, "a job");
  EXPECT_EQ(document.job.labels, (std::map<std::string, std::string>{{"", "x"}, {"team", "blue"}}));
  EXPECT_EQ(document.job.priority, 70);
  EXPECT_EQ(document.job.max_attempts, 5);
  EXPECT_EQ(document.job.run_after, 1'896'112'800'000);
  EXPECT_EQ(document.job.deadline, 1'896'129'000'250) << "with an offset of two hours";
  EXPECT_EQ(document.job.expires_in_s, 86400);
  EXPECT_EQ(document.job.cache, api::CacheUse::refresh);
  EXPECT_FALSE(document.job.keep);
  EXPECT_EQ(document.job.webhook, (api::Webhook{"https://example.org/hook?a=b", {"failed", "succeeded"}}));
}

TEST(SceneReader, NamesTheJobAfterTheScene) {
  EXPECT_EQ(accepted(document_with(R"("name": "s")")).job.name, "s");
  EXPECT_EQ(accepted(document_with(R"("name": "s", "job": {"name": "j"})")).job.name, "j");
}

TEST(SceneReader, ResolvesMaterialNamesDefinedAnywhere) {
  const auto scene =
      accepted(document_with(
                   R"("objects": [{"type": "plane", "point": [0,0,0], "normal": [0,1,0], "material": "b"}],
                                  "materials": {"a": {}, "b": {"color": "t"}}, "textures": {"t": {"checker": [0,1]}})"))
          .scene;
  EXPECT_EQ(scene.materials.at(scene.objects.at(0).material.index).path, "/materials/b");
}

TEST(SceneReader, ChangesTheDefaultMeridianOfASphereWithAxisX) {
  const auto scene =
      accepted(document_with_object("sphere", R"("center": [0,0,0], "radius": 1, "axis": [-2,0,0])")).scene;
  EXPECT_EQ(std::get<tracer::Sphere>(scene.objects.at(0).shape).meridian, (Vec3{0, 0, 1}));
}

TEST(SceneReader, AcceptsAnySpellingOfIntegers) {
  for (const char* text : {"40", "40.0", "4e1", "400E-1", "4.0e+1"}) {
    const auto scene = accepted(document_with(R"("image": {"width": )" + std::string(text) + "}")).scene;
    EXPECT_EQ(scene.image.width, 40u) << text;
  }
}

TEST(SceneReader, ReadsEnvironmentsBeforeTheirTextures) {
  const tracer::Scene scene = scene_of("every_field_of_environments.json");
  ASSERT_TRUE(scene.background.environment);
  EXPECT_EQ(scene.background.environment->texture.index, 1u);
  EXPECT_EQ(scene.background.environment->rotation_deg, -30);
  EXPECT_EQ(scene.background.up, (tracer::Vec3{1, 0, 2}));
  EXPECT_FALSE(scene.background.gradient || scene.background.cube);
}

TEST(SceneReader, ReadsCubeFacesInAnyOrder) {
  const tracer::Scene scene = scene_of("every_field_of_cubes.json");
  ASSERT_TRUE(scene.background.cube);
  EXPECT_FALSE(scene.background.up) << "that of the camera";
  const auto& faces = scene.background.cube->faces;
  EXPECT_EQ(scene.textures[faces[0].index].path, "/background/cube/+x");
  for (std::uint32_t face = 1; face < 6; ++face) EXPECT_EQ(faces[face].index, face - 1) << "in the order of the faces";
}

TEST(SceneReader, ReadsBumpsAndNormalMaps) {
  const tracer::Scene& scene = every_field();
  const tracer::Material& glass = scene.materials.at(0);
  ASSERT_TRUE(glass.bump && glass.normal_map);
  EXPECT_EQ(scene.textures[glass.bump->texture.index].path, "/textures/marble");
  EXPECT_EQ(glass.bump->scale, -0.25);
  EXPECT_EQ(scene.textures[glass.normal_map->index].path, "/textures/oak");
}

TEST(TextureReader, RejectsFilesWithoutAssets) {
  api::Limits limits;
  limits.files = api::Files::none;
  EXPECT_EQ(outcome(document_with(R"("background": {"environment": {"file": "sky.hdr"}})"), limits),
            (std::vector<std::string>{"/background/environment/file unsupported"}));
}

TEST(DefaultValues, OfSceneMatchTheSceneHeader) {
  const tracer::Scene scene = accepted(document_with()).scene;
  EXPECT_EQ(scene.name, "");
  EXPECT_EQ(scene.image.width, 640u);
  EXPECT_EQ(scene.image.height, 480u);
  EXPECT_EQ(scene.background.color, Color{});
  EXPECT_EQ(scene.background.up, (Vec3{0, 1, 0}));
  EXPECT_EQ(scene.ambient, Color{});
  EXPECT_TRUE(scene.lights.empty() && scene.textures.empty() && scene.materials.empty() && scene.objects.empty());
  EXPECT_EQ(scene.accuracy.seed, 0u);
}

TEST(DefaultValues, OfJobAreMediumPriorityAndThreeAttempts) {
  const api::JobRequest job = accepted(document_with()).job;
  EXPECT_EQ(job, api::JobRequest{});
  EXPECT_EQ(job.priority, 50);
  EXPECT_EQ(job.max_attempts, 3);
  EXPECT_EQ(job.cache, api::CacheUse::use);
  EXPECT_TRUE(job.keep);
  const std::string hook = R"("job": {"webhook": {"url": "http://127.0.0.1/"}})";
  EXPECT_EQ(accepted(document_with(hook)).job.webhook->events,
            (std::vector<std::string>{"succeeded", "failed", "cancelled"}));
}

TEST(DefaultValues, OfSpheresAndMeshesAreTheConventionalAxisAndFlat) {
  const auto shape = [](std::string_view type, std::string_view members) {
    return accepted(document_with_object(type, members)).scene.objects.at(0).shape;
  };
  EXPECT_EQ(std::get<tracer::Sphere>(shape("sphere", R"("center": [0,0,0], "radius": 1)")).meridian, (Vec3{1, 0, 0}));
  const auto mesh =
      std::get<tracer::Mesh>(shape("mesh", R"("positions": [[0,0,0],[1,0,0],[0,1,0]], "triangles": [[0,1,2]])"));
  EXPECT_FALSE(mesh.smooth);
  EXPECT_TRUE(mesh.normals.empty() && mesh.uvs.empty());
}

TEST(DefaultValues, OfTexturesAreNoRotationUnitScaleAndNoBump) {
  const auto scene = accepted(document_with(R"("background": {"environment": {"checker": [0, 1]}},
                                               "materials": {"a": {"bump": {"texture": {"checker": [0, 1]}}}, "b": {}})"))
                         .scene;
  EXPECT_EQ(scene.background.environment->rotation_deg, 0);
  EXPECT_EQ(scene.materials[0].bump->scale, 1);
  EXPECT_FALSE(scene.materials[0].normal_map || scene.materials[1].bump || scene.materials[1].normal_map);
}

Color ambient_of(const std::string& color) { return accepted(document_with(R"("ambient": )" + color)).scene.ambient; }

void expect_near(const Color& seen, const Color& expected) {
  EXPECT_NEAR(seen.r, expected.r, 1e-12);
  EXPECT_NEAR(seen.g, expected.g, 1e-12);
  EXPECT_NEAR(seen.b, expected.b, 1e-12);
}

TEST(ColorReader, ReadsAllFourForms) {
  EXPECT_EQ(ambient_of("[0.5, 2, 0]"), (Color{0.5, 2, 0}));
  EXPECT_EQ(ambient_of("3"), (Color{3, 3, 3}));
  EXPECT_EQ(ambient_of(R"("#FF00ff")"), (Color{1, 0, 1}));
  expect_near(ambient_of(R"({"hsb": [0, 1, 1]})"), {1, 0, 0});
}

TEST(ColorReader, DecodesTextFromSrgb) {
  // IEC 61966-2-1 at both branches: 10/255 is on the straight part, 0xBC encodes about one half.
  expect_near(ambient_of(R"("#0a0a0a")"), {10 / 255.0 / 12.92, 10 / 255.0 / 12.92, 10 / 255.0 / 12.92});
  EXPECT_NEAR(ambient_of(R"("#bc0000")").r, 0.5028864580325687, 1e-12);
  EXPECT_NEAR(ambient_of(R"("#c03020")").g, 0.0295568344378088, 1e-12);
}

TEST(ColorReader, ConvertsHueSaturationBrightnessFromSrgb) {
  const auto hsb = [](const std::string& values) { return ambient_of(R"({"hsb": [)" + values + "]}"); };
  const double half = std::pow((0.5 + 0.055) / 1.055, 2.4);
  expect_near(hsb("120, 1, 1"), {0, 1, 0});
  expect_near(hsb("240, 1, 1"), {0, 0, 1});
  expect_near(hsb("60, 1, 1"), {1, 1, 0});
  expect_near(hsb("200, 0, 0.5"), {half, half, half});
  expect_near(hsb("0, 0.5, 1"), {1, half, half});
  expect_near(hsb("30, 1, 1"), {1, half, 0});
  // Hues are angles.
  expect_near(hsb("-120, 1, 1"), {0, 0, 1});
  expect_near(hsb("480, 1, 1"), {0, 1, 0});
  expect_near(hsb("360, 1, 1"), {1, 0, 0});
}

TEST(MaterialReader, EnablesFresnelForTransmissionByDefault) {
  const auto fresnel_and_reflection = [](const std::string& members) {
    const tracer::Material material =
        accepted(document_with(R"("materials": {"m": {)" + members + "}}")).scene.materials.at(0);
    return std::pair(material.fresnel, material.reflection);
  };
  EXPECT_EQ(fresnel_and_reflection(R"("transmission": 0.5)"), std::pair(true, 1.0));
  EXPECT_EQ(fresnel_and_reflection(R"("transmission": 0.5, "reflection": 0.25)"), std::pair(true, 0.25));
  EXPECT_EQ(fresnel_and_reflection(R"("transmission": 0.5, "fresnel": false)"), std::pair(false, 0.0));
  EXPECT_EQ(fresnel_and_reflection(R"("transmission": 0.5, "transparency": "interpolated")"), std::pair(false, 0.0));
  EXPECT_EQ(fresnel_and_reflection(R"("transmission": 0.5, "transparency": "filtered")"), std::pair(false, 0.0));
  EXPECT_EQ(fresnel_and_reflection(R"("fresnel": true)"), std::pair(true, 1.0));
}

}  // namespace
