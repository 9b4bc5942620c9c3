/// Warnings of many similar scenes; tests/reader/invalid/warnings.jsonl has the others.

#include "tracer/warnings.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "api/report.h"
#include "tests/reader/reading.h"

namespace {

using namespace reader_tests;
using Lines = std::vector<std::string>;

/// A lit sphere in the middle of the image, and `members`.
Lines warnings_with(const std::string& members, const std::string& objects = {}, const std::string& lights = {}) {
  return warnings_of(document_with(R"("objects": [{"type": "sphere", "center": [0,0,0], "radius": 1, "material": {}})" +
                                   objects + R"(], "lights": [{"type": "point", "position": [3,9,3]})" + lights + "]" +
                                   (members.empty() ? "" : ", ") + members));
}

std::string sphere_at(const std::string& center, const std::string& radius, const std::string& material = "{}") {
  return R"({"type": "sphere", "center": )" + center + R"(, "radius": )" + radius + R"(, "material": )" + material +
         "}";
}

TEST(Warnings, OfExampleScenesAreNone) {
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(WHITTLE_SOURCE_DIR "/scenes")) {
    if (entry.path().extension() != ".json") continue;
    EXPECT_EQ(warnings_of(file_bytes(entry.path())), Lines{}) << entry.path();
    ++files;
  }
  EXPECT_GT(files, 0u);
}

/// Closed shapes, each the text before its material, with the camera of document_with() at [0,1,6] inside.
const std::vector<std::string> shapes_around_the_camera{
    R"("type": "sphere", "center": [0,1,6.3], "radius": 0.5)",
    R"("type": "sphere", "radius": 1, "position": [0,0.2,6], "scale": [0.2,2,0.2])",
    R"("type": "box", "min": [-0.5,0.6,5.7], "max": [0.4,1.3,6.2])",
    R"("type": "box", "size": [1,2,3], "rotate": [10,20,30], "position": [0,1,6])",
    R"("type": "cylinder", "from": [0,0.5,6], "to": [0.1,1.6,6], "radius": 0.4)",
    R"("type": "cone", "base": [0,0.8,6], "apex": [0,2,6], "radius": 0.3)",
    R"("type": "cone", "base": [0,0.8,6], "apex": [0,2,6], "radius": 0.1, "apex_radius": 0.7)",
    R"("type": "torus", "center": [2,1,6], "axis": [0,1,0], "major_radius": 2, "minor_radius": 0.2)",
    R"("type": "mesh", "positions": [[-1,0,5],[1,0,5],[0,0,7.5],[0,3,6]],
        "triangles": [[0,1,2],[0,3,1],[1,3,2],[2,3,0]])"};

Lines warnings_around_the_camera(const std::string& shape, const std::string& material = "{}",
                                 const std::string& members = {}) {
  return warnings_with(members, ", {" + shape + R"(, "material": )" + material + "}");
}

TEST(Warnings, NameACameraWithinAnOpaqueSolid) {
  for (const std::string& shape : shapes_around_the_camera) {
    EXPECT_EQ(warnings_around_the_camera(shape), Lines{"/camera/position camera_enclosed"}) << shape;
    EXPECT_EQ(warnings_around_the_camera(shape, R"({"reflection": 0.5})"), Lines{"/camera/position camera_enclosed"});
    for (const char* through : {R"({"color": 0, "transmission": 0.5})", R"({"opacity": 0.5})"})
      EXPECT_EQ(warnings_around_the_camera(shape, through), Lines{}) << shape << through;
  }
}

TEST(Warnings, LetTheCameraBeInRoomsDomesAndBesideSolids) {
  for (const std::string& shape : shapes_around_the_camera) {
    const std::string solid = ", {" + shape + R"(, "material": {}})";
    EXPECT_EQ(warnings_with("", solid + ", " + sphere_at("[0,0.96,5.96]", "0.01")), Lines{})
        << "an object in " << shape;
    EXPECT_EQ(warnings_with("", solid, R"(, {"type": "point", "position": [0,0.96,5.96]})"), Lines{}) << "a light";
    EXPECT_EQ(warnings_around_the_camera(shape, R"({"emission": 0.5})"), Lines{}) << "a glowing dome";
    EXPECT_EQ(warnings_around_the_camera(shape, R"({"color": {"checker": [0, 1]}})", R"("ambient": 1)"), Lines{});
  }
  for (const char* beside :
       {R"("type": "sphere", "center": [0.35,1.35,6.35], "radius": 0.6)",  // in its box only
        R"("type": "box", "center": [0,1,8], "size": [1,1,3.9])",
        R"("type": "cylinder", "from": [0,0.5,6], "to": [0,1.6,6], "radius": 0.4, "caps": false)",
        R"("type": "cone", "base": [0,0.8,6], "apex": [0.6,2,6], "radius": 0.05)",
        R"("type": "torus", "center": [0,1,6], "axis": [0,1,0], "major_radius": 1, "minor_radius": 0.2)",
        R"("type": "mesh", "positions": [[-1,0,5],[1,0,5],[0,0,7.5],[0,3,6]], "triangles": [[0,1,2],[0,3,1],[1,3,2]])"})
    EXPECT_EQ(warnings_around_the_camera(beside), Lines{}) << beside;
}

TEST(Warnings, NameLightsTooFaintToBeSeen) {
  const auto with_light = [](const std::string& source, const std::string& attenuation = R"("inverse_square")") {
    return ", {" + source + R"(, "attenuation": )" + attenuation + "}";
  };
  const Lines dim{"/lights/1/intensity light_too_faint"};
  for (const std::string source :
       {R"("type": "point", "position": [0,170,0])", R"("type": "sphere", "center": [170,0,0], "radius": 2)",
        R"("type": "spot", "position": [0,0,170], "target": [0,0,0], "inner_angle": 9, "outer_angle": 20)",
        R"("type": "rect", "corner": [0,170,0], "edge_u": [2,0,0], "edge_v": [0,0,2])",
        R"("type": "disc", "center": [0,170,0], "normal": [0,1,0], "radius": 2)",
        R"("type": "line", "from": [0,170,0], "to": [1,171,0])"}) {
    EXPECT_EQ(warnings_with("", "", with_light(source)), dim) << source;
    EXPECT_EQ(warnings_with("", "", with_light(source, "[0,0,1]")), dim) << source;
    EXPECT_EQ(warnings_with("", "", with_light(source, R"("none")")), Lines{}) << source;
    EXPECT_EQ(warnings_with("", "", with_light(source, "[1,0.01,0]")), Lines{}) << source;
    EXPECT_EQ(warnings_with("", "", with_light(source + R"(, "intensity": 1e4)")), Lines{}) << source;
    EXPECT_EQ(warnings_with("", "", with_light(source + R"(, "intensity": 0)")), Lines{}) << source;
    EXPECT_EQ(warnings_with(R"("output": {"exposure": 3})", "", with_light(source)), Lines{}) << source;
    EXPECT_EQ(warnings_with("", ", " + sphere_at("[60,60,60]", "90"), with_light(source)), Lines{}) << source;
    EXPECT_EQ(warnings_with("", ", " + sphere_at("[60,60,60]", "90", R"({"diffuse": 0})"), with_light(source)), dim);
  }
  const std::string point = with_light(R"("type": "point", "position": [0,170,0])");
  EXPECT_EQ(warnings_with("", R"(, {"type": "plane", "point": [0,150,0], "normal": [0,1,0], "material": {}})", point),
            Lines{});
  EXPECT_EQ(warnings_with("", R"(, {"type": "plane", "point": [0,-5,0], "normal": [0,1,0], "material": {}})", point),
            dim);
  EXPECT_EQ(warnings_with("", "", point + point).size(), 2u);
  std::string many;
  for (int i = 0; i < 20; ++i) many += point;
  EXPECT_EQ(warnings_with("", "", many), Lines{}) << "bright together";
}

TEST(Warnings, NameHighlightsThatGlowingObjectsDoNotHave) {
  const auto beside = [](const std::string& shiny, const std::string& lamp, const std::string& model = "global") {
    return warnings_with(R"("accuracy": {"model": ")" + model + "\"}",
                         ", " + sphere_at("[3,0,0]", "1", shiny) + ", " + sphere_at("[-3,8,3]", "1", lamp));
  };
  const std::string lamp = R"({"emission": 0.9})";
  for (const char* model : {"phong", "blinn_phong"})
    for (const char* field : {"specular", "specular_transmission"}) {
      const std::string shiny = R"({"model": ")" + std::string(model) + R"(", ")" + field + R"(": 0.5)";
      EXPECT_EQ(beside(shiny + "}", lamp), Lines{"/objects/1/material/" + std::string(field) + " highlight_omitted"});
      EXPECT_EQ(beside(shiny + "}", "{}"), Lines{}) << "no lamp";
      EXPECT_EQ(beside(shiny + "}", lamp, "whitted"), Lines{});
      EXPECT_EQ(beside(shiny + R"(, "specular_color": 0})", lamp), Lines{});
      EXPECT_EQ(beside("{}", shiny + R"(, "emission": 5})"), Lines{}) << "only the lamp itself shines";
    }
  EXPECT_EQ(beside(R"({"model": "lambert", "specular": 0.5})", lamp), Lines{});
  EXPECT_EQ(beside(R"({"specular": 0})", lamp), Lines{});
}

TEST(Warnings, NameTransmissiveMaterialsThatMakeLight) {
  const auto made_of = [](const std::string& members) {
    return warnings_with(R"("materials": {"glass": {)" + members + "}}");
  };
  const Lines milky{"/materials/glass/diffuse energy_gain"};
  for (const std::string transmission :
       {R"("transmission": 1)", R"("transmission": 0.3)", R"("transmission": 0.5, "fresnel": false)",
        R"("transmission": 0.5, "transparency": "filtered")"}) {
    EXPECT_EQ(made_of(transmission), milky) << transmission;
    EXPECT_EQ(made_of(transmission + R"(, "color": "#4060ff")"), milky) << transmission;
    EXPECT_EQ(made_of(transmission + R"(, "color": {"checker": [0, 1]})"), milky) << transmission;
    EXPECT_EQ(made_of(transmission + R"(, "color": 0)"), Lines{}) << transmission;
    EXPECT_EQ(made_of(transmission + R"(, "diffuse": 0)"), Lines{}) << transmission;
    EXPECT_EQ(made_of(transmission + R"(, "diffuse": 0.9)"), Lines{}) << "as it is written: " << transmission;
  }
  EXPECT_EQ(made_of(R"("transmission": 0.5, "transparency": "interpolated")"), Lines{}) << "0.5 of 0.8 + 0.5";
  EXPECT_EQ(made_of(R"("transmission": 0.2, "fresnel": false)"), Lines{}) << "0.8 + 0.2";
  EXPECT_EQ(made_of(R"("transmission": 0, "reflection": 1)"), Lines{}) << "opaque";
}

TEST(Warnings, NameNothingSmallThatIsAtTheOriginOfALargeScene) {
  for (const std::string large : {"1e8", "1e12", "1e24"}) {
    const std::string camera = R"("camera": {"position": [0,0,8e-6], "look_at": [0,0,0]})";
    const auto warned = [&](const std::string& center) {
      return warnings_of(R"({"version": 1, "ambient": 1, )" + camera + R"(, "objects": [)" + sphere_at(center, "1e-6") +
                         "," + sphere_at("[0,0,0]", large) + "]}");
    };
    EXPECT_EQ(warned("[0,0,0]"), Lines{}) << large;
    EXPECT_EQ(warned("[0,0,-" + large + "]"), Lines{"/objects/0 beyond_precision"}) << large;
  }
}

TEST(Warnings, AreLimitedInNumber) {
  std::string materials;
  for (int i = 0; i < 150; ++i)
    materials += std::string(i ? "," : "") + "\"" + std::to_string(i) + R"(": {"color": 2})";
  EXPECT_EQ(warnings_with("\"materials\": {" + materials + "}").size(), tracer::warnings_max);
}

TEST(Warnings, ArePartOfTheReportAndOfTheValidation) {
  const tracer::Scene scene =
      accepted(R"({"version": 1, "camera": {"position": [0,0,6], "look_at": [0,0,0], "fov": 0.8}, "ambient": 1,
                   "objects": [)" +
               sphere_at("[0,0,0]", "1") + "]}")
          .scene;
  const std::string warning =
      R"("warnings":[{"pointer":"#/camera/fov","code":"radians","detail":"angles are in degrees, got 0.8: is it in radians?"}])";
  for (const std::string& text : {api::write_valid(scene, std::nullopt), api::write_report(scene, {}, {}, {}, {}, 0)})
    EXPECT_NE(text.find(warning), std::string::npos) << text;
  EXPECT_NE(api::write_invalid({}).find(R"("warnings":[])"), std::string::npos);
}

}  // namespace
