/// Short forms: each reads as its long form.

#include <gtest/gtest.h>

#include <string>
#include <variant>
#include <vector>

#include "tests/reader/reading.h"

namespace {

using namespace reader_tests;
using tracer::Color;
using tracer::Vec3;

Color background(const std::string& color) {
  return accepted(document_with("\"background\": " + color)).scene.background.color;
}

tracer::Object object(const std::string& type_and_fields) {
  return accepted(document_with(R"("objects": [{"material": {}, "type": )" + type_and_fields + "}]"))
      .scene.objects.at(0);
}

TEST(Shorthands, OfColorsAreDecodedLikeSixDigits) {
  EXPECT_EQ(background(R"("#fa0")"), background(R"({"color": "#ffaa00"})"));
  EXPECT_EQ(background(R"("rebeccapurple")"), background(R"("#663399")"));
  EXPECT_EQ(background(R"("aliceblue")"), background(R"("#f0f8ff")"));
  EXPECT_EQ(background(R"("yellowgreen")"), background(R"("#9acd32")"));
  EXPECT_EQ(background("0.5"), (Color{0.5, 0.5, 0.5}));
  EXPECT_EQ(background("[0, 1, 2]"), (Color{0, 1, 2}));
  EXPECT_EQ(background(R"({"hsb": [0, 1, 1]})"), (Color{1, 0, 0}));
}

TEST(Shorthands, OfColorsGiveWayToTheNamesOfTextures) {
  const auto color = [](const std::string& name) {
    return accepted(document_with(R"("textures": {"gold": {"checker": [0, 1]}}, "materials": {"m": {"color": ")" +
                                  name + "\"}}"))
        .scene.materials.at(0)
        .color;
  };
  EXPECT_TRUE(std::holds_alternative<tracer::TextureId>(color("gold")));
  EXPECT_EQ(std::get<Color>(color("red")), (Color{1, 0, 0}));
}

TEST(Shorthands, OfSamplesAndTextureScalesRepeatTheNumber) {
  EXPECT_EQ(accepted(document_with(R"("accuracy": {"samples": 7})")).scene.accuracy.samples, 7u);
  EXPECT_FALSE(accepted(document_with(R"("accuracy": {"samples": 7})")).scene.accuracy.adaptive);
  EXPECT_EQ(accepted(document_with(R"("textures": {"t": {"checker": [0, 1], "scale": 3}})")).scene.textures.at(0).scale,
            (tracer::Vec2{3, 3}));
}

TEST(Shorthands, OfTransformsAreTheStepsScaleRotateTranslate) {
  const std::string sphere = R"("sphere", "center": [0,0,0], "radius": 1, )";
  const auto short_form = object(sphere + R"("position": [1, 2, 3], "rotate": [10, 20, 30], "scale": [1, 2, 4])");
  const auto long_form =
      object(sphere + R"("transform": [{"scale": [1, 2, 4]}, {"rotate": {"axis": [1, 0, 0], "angle": 10}},
                                       {"rotate": {"axis": [0, 1, 0], "angle": 20}},
                                       {"rotate": {"axis": [0, 0, 1], "angle": 30}}, {"translate": [1, 2, 3]}])");
  EXPECT_EQ(short_form.transform, long_form.transform);
  EXPECT_EQ(object(sphere + R"("transform": [{"rotate": [10, 20, 30]}])").transform,
            object(sphere + R"("rotate": [10, 20, 30])").transform);
  EXPECT_EQ(object(sphere + R"("scale": 2)").transform, object(sphere + R"("transform": [{"scale": 2}])").transform);
  EXPECT_FALSE(object(R"("sphere", "center": [0,0,0], "radius": 1)").transform);
  EXPECT_EQ(object(R"("sphere", "radius": 1, "position": [1,2,3])").transform->rows[1][3], 2);
}

TEST(Shorthands, OfBoxesCylindersAndConesAreTheirEnds) {
  const auto box = std::get<tracer::Box>(object(R"("box", "center": [1, 2, 3], "size": [2, 4, 8])").shape);
  EXPECT_EQ(box.min, (Vec3{0, 0, -1}));
  EXPECT_EQ(box.max, (Vec3{2, 4, 7}));
  EXPECT_EQ(std::get<tracer::Box>(object(R"("box", "size": 2, "position": [9, 9, 9])").shape).min, (Vec3{-1, -1, -1}));
  const auto cylinder =
      std::get<tracer::Cylinder>(object(R"("cylinder", "base": [1, 2, 3], "height": 4, "radius": 5)").shape);
  EXPECT_EQ(cylinder.from, (Vec3{1, 2, 3}));
  EXPECT_EQ(cylinder.to, (Vec3{1, 6, 3}));
  EXPECT_EQ(cylinder.radius, 5);
  const auto cone = std::get<tracer::Cone>(object(R"("cone", "base": [1, 2, 3], "height": 4, "radius": 5)").shape);
  EXPECT_EQ(cone.base, (Vec3{1, 2, 3}));
  EXPECT_EQ(cone.apex, (Vec3{1, 6, 3}));
}

TEST(VisibleLights, AreObjectsWithoutShadowThatEmit) {
  const auto scene = accepted(document_with(R"("lights": [
      {"type": "point", "position": [0, 9, 0]},
      {"type": "rect", "corner": [1, 9, 0], "edge_u": [2, 0, 0], "edge_v": [0, 0, 3], "color": [1, 0.5, 0], "intensity": 2,
       "visible": true},
      {"type": "sphere", "center": [0, 9, 0], "radius": 1, "visible": false},
      {"type": "disc", "center": [0, 9, 0], "normal": [0, 1, 0], "radius": 1, "visible": true}])"))
                         .scene;
  ASSERT_EQ(scene.objects.size(), 2u);
  for (const tracer::Object& each : scene.objects) EXPECT_FALSE(each.shadow);
  ASSERT_EQ(scene.materials.size(), 2u);
  EXPECT_EQ(std::get<Color>(scene.materials[0].emission), (Color{2, 1, 0}));
  EXPECT_EQ(scene.materials[0].ambient + scene.materials[0].diffuse + scene.materials[0].specular, 0);
  ASSERT_EQ(scene.prototypes.size(), 2u);
  EXPECT_EQ(scene.prototypes[0].path, "/lights/1");
  EXPECT_EQ(scene.prototypes[1].path, "/lights/3");
  const auto& rect = std::get<tracer::Mesh>(scene.prototypes[0].objects.at(0).shape);
  EXPECT_EQ(rect.positions, (std::vector<Vec3>{{1, 9, 0}, {3, 9, 0}, {3, 9, 3}, {1, 9, 3}}));
  EXPECT_EQ(std::get<tracer::Disc>(scene.prototypes[1].objects.at(0).shape).radius, 1);
}

TEST(Shorthands, HaveDigestsOfTheirOwn) {
  const auto digest = [](const std::string& members) {
    api::Digests digests;
    EXPECT_TRUE(api::parse_scene(document_with(members), {}, &digests));
    return digests.at("background");
  };
  EXPECT_NE(digest(R"("background": "red")"), digest(R"("background": {"color": "red"})"));
}

}  // namespace
