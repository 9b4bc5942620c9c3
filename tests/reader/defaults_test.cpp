/// Default values of fields without a table (the others are those of the members, which api/docs/scene.md states and
/// tests/docs compares), defaults that depend on other fields, and the four forms of a color.

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
using tracer::Vec3;

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

TEST(DefaultValues, OfSceneMatchTheSceneHeader) {
  const tracer::Scene scene = accepted(document_with()).scene;
  EXPECT_EQ(scene.name, "");
  EXPECT_EQ(scene.image.width, 640u);
  EXPECT_EQ(scene.image.height, 480u);
  EXPECT_EQ(scene.background.color, Color{});
  EXPECT_EQ(scene.background.up, (Vec3{0, 1, 0}));
  EXPECT_EQ(scene.ambient, Color{});
  EXPECT_TRUE(scene.lights.empty() && scene.textures.empty() && scene.materials.empty() && scene.objects.empty());
  EXPECT_EQ(scene.accuracy.max_depth, tracer::default_max_depth(true));
  EXPECT_EQ(scene.accuracy.seed, 0u);
}

TEST(DefaultValues, OfJobAreMediumPriorityAndThreeAttempts) {
  const api::JobRequest job = accepted(document_with()).job;
  EXPECT_EQ(job.priority, 50);
  EXPECT_EQ(job.max_attempts, 3);
  EXPECT_TRUE(job.labels.empty());
  EXPECT_EQ(job.run_after, std::nullopt);
  EXPECT_EQ(job.deadline, std::nullopt);
  EXPECT_EQ(job.expires_in_s, std::nullopt);
  EXPECT_EQ(job.cache, api::CacheUse::use);
  EXPECT_TRUE(job.keep);
  EXPECT_EQ(job.webhook, std::nullopt);
  const std::string hook = R"("job": {"webhook": {"url": "http://127.0.0.1/"}})";
  EXPECT_EQ(accepted(document_with(hook)).job.webhook->events,
            (std::vector<std::string>{"succeeded", "failed", "cancelled"}));
}

TEST(DefaultValues, OfShapesAreTheConventionalAxes) {
  const auto sphere = accepted(document_with_object("sphere", R"("center": [0,0,0], "radius": 1)")).scene;
  ASSERT_EQ(sphere.objects.size(), 1u);
  EXPECT_EQ(std::get<tracer::Sphere>(sphere.objects[0].shape).meridian, (Vec3{1, 0, 0}));
  const auto mesh =
      accepted(document_with_object("mesh", R"("positions": [[0,0,0],[1,0,0],[0,1,0]], "triangles": [[0,1,2]])")).scene;
  ASSERT_EQ(mesh.objects.size(), 1u);
  EXPECT_FALSE(std::get<tracer::Mesh>(mesh.objects[0].shape).smooth);
  EXPECT_TRUE(std::get<tracer::Mesh>(mesh.objects[0].shape).normals.empty());
  EXPECT_TRUE(std::get<tracer::Mesh>(mesh.objects[0].shape).uvs.empty());
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
  expect_near(ambient_of(R"({"hsb": [120, 1, 1]})"), {0, 1, 0});
  expect_near(ambient_of(R"({"hsb": [240, 1, 1]})"), {0, 0, 1});
  expect_near(ambient_of(R"({"hsb": [60, 1, 1]})"), {1, 1, 0});
  const double half = std::pow((0.5 + 0.055) / 1.055, 2.4);
  expect_near(ambient_of(R"({"hsb": [200, 0, 0.5]})"), {half, half, half});
  expect_near(ambient_of(R"({"hsb": [0, 0.5, 1]})"), {1, half, half});
  expect_near(ambient_of(R"({"hsb": [30, 1, 1]})"), {1, half, 0});
}

TEST(ColorReader, WrapsHues) {
  expect_near(ambient_of(R"({"hsb": [-120, 1, 1]})"), {0, 0, 1});
  expect_near(ambient_of(R"({"hsb": [480, 1, 1]})"), {0, 1, 0});
  expect_near(ambient_of(R"({"hsb": [360, 1, 1]})"), {1, 0, 0});
}

TEST(MaterialReader, EnablesFresnelForTransmissionByDefault) {
  const tracer::Material glass = material_of(R"("transmission": 0.5)");
  EXPECT_TRUE(glass.fresnel);
  EXPECT_EQ(glass.reflection, 1);
  const tracer::Material dull = material_of(R"("transmission": 0.5, "reflection": 0.25)");
  EXPECT_TRUE(dull.fresnel);
  EXPECT_EQ(dull.reflection, 0.25);
  const tracer::Material plain = material_of(R"("fresnel": false, "transmission": 0.5)");
  EXPECT_FALSE(plain.fresnel);
  EXPECT_EQ(plain.reflection, 0);
  for (const char* transparency : {"interpolated", "filtered"}) {
    const tracer::Material thin =
        material_of(R"("transmission": 0.5, "transparency": ")" + std::string(transparency) + "\"");
    EXPECT_FALSE(thin.fresnel) << transparency;
    EXPECT_EQ(thin.reflection, 0) << transparency;
  }
  const tracer::Material lacquer = material_of(R"("fresnel": true)");
  EXPECT_TRUE(lacquer.fresnel);
  EXPECT_EQ(lacquer.reflection, 1);
}

}  // namespace
