/// Warnings of scenes that are accepted and are probably not meant.

#include "tracer/warnings.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "api/report.h"
#include "tests/reader/reading.h"

namespace {

using reader_tests::accepted;
using reader_tests::document_with;
using Lines = std::vector<std::string>;

Lines warnings_of(const std::string& text) {
  Lines lines;
  for (const tracer::Issue& warning : tracer::warnings(accepted(text).scene)) {
    lines.push_back(warning.pointer + " " + warning.code);
    EXPECT_FALSE(warning.detail.empty());
  }
  return lines;
}

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

std::string camera_with(const std::string& members) {
  return R"({"version": 1, "ambient": 1, "camera": {"position": [0,0,6], "look_at": [0,0,0], )" + members +
         R"(}, "objects": [)" + sphere_at("[0,0,0]", "1") + "]}";
}

TEST(Warnings, OfAUsualSceneAreNone) { EXPECT_EQ(warnings_with(""), Lines{}); }

TEST(Warnings, OfExampleScenesAreNone) {
  for (const auto& entry : std::filesystem::directory_iterator(WHITTLE_SOURCE_DIR "/scenes")) {
    if (entry.path().extension() != ".json") continue;
    EXPECT_EQ(warnings_of(reader_tests::file_bytes(entry.path())), Lines{}) << entry.path();
  }
}

TEST(Warnings, NameColorsAboveOne) {
  EXPECT_EQ(warnings_with(R"("materials": {"red": {"color": [200, 30, 30]}, "white": {"color": 1}})"),
            Lines{"/materials/red/color color_above_1"});
  EXPECT_EQ(warnings_with(R"("textures": {"c": {"checker": [1, 2]}, "h": {"noise": [0, 9]}},
                             "materials": {"m": {"color": "c", "bump": {"texture": "h"}}})"),
            Lines{"/textures/c color_above_1"});
}

TEST(Warnings, NameRadianceOnlyIfItLooksLikeBytes) {
  EXPECT_EQ(warnings_with(R"("ambient": [255, 240, 0], "background": {"color": [20, 30.5, 40]})", "",
                          R"(, {"type": "point", "position": [0,9,0], "color": [255,240,220]},
                             {"type": "point", "position": [0,9,0], "color": [50,50,50], "attenuation": "inverse_square"},
                             {"type": "point", "position": [0,9,0], "color": [4,4,4]})"),
            (Lines{"/lights/1/color color_above_1", "/ambient color_above_1"}));
}

TEST(Warnings, NameAnglesThatLookLikeRadians) {
  EXPECT_EQ(warnings_of(camera_with(R"("fov": 0.8)")), Lines{"/camera/fov radians"});
  EXPECT_EQ(warnings_of(camera_with(R"("fov": 4)")), Lines{});
  EXPECT_EQ(warnings_of(camera_with(R"("fov": 0.8, "type": "panorama")")), Lines{});
  const std::string spot = R"(, {"type": "spot", "position": [0,9,0], "direction": [0,-1,0], "inner_angle": 0.2, )";
  EXPECT_EQ(warnings_with("", "", spot + R"("outer_angle": 0.5})"), Lines{"/lights/1/outer_angle radians"});
  EXPECT_EQ(warnings_with("", "", spot + R"("outer_angle": 2})"), Lines{});
}

TEST(Warnings, NameScenesWithoutLight) {
  const auto lit_by = [](const std::string& members, const std::string& material = "{}") {
    return warnings_of(document_with(R"("objects": [)" + sphere_at("[0,0,0]", "1", material) + "]" + members));
  };
  EXPECT_EQ(lit_by(""), Lines{"/lights nothing_lit"});
  EXPECT_EQ(lit_by(R"(, "background": {"color": 1})"), Lines{"/lights nothing_lit"});
  EXPECT_EQ(lit_by(R"(, "lights": [{"type": "point", "position": [0,9,0], "intensity": 0}])"),
            Lines{"/lights nothing_lit"});
  EXPECT_EQ(lit_by(R"(, "background": {"color": 1})", R"({"reflection": 1})"), Lines{});
  EXPECT_EQ(lit_by("", R"({"emission": 1})"), Lines{});
  EXPECT_EQ(lit_by(R"(, "ambient": 0.1)"), Lines{});
}

TEST(Warnings, NameBlackImages) {
  const auto seen = [](const std::string& objects, const std::string& members = {}) {
    return warnings_of(
        R"({"version": 1, "ambient": 1, "camera": {"position": [0,0,6], "look_at": [0,0,0]}, "objects": [)" + objects +
        "]" + members + "}");
  };
  EXPECT_EQ(seen(""), Lines{"/objects nothing_in_view"});
  EXPECT_EQ(seen(sphere_at("[50,0,0]", "1")), Lines{"/objects nothing_in_view"});
  EXPECT_EQ(seen(sphere_at("[50,0,0]", "1"), R"(, "background": {"color": 1})"), Lines{});
  EXPECT_EQ(seen(sphere_at("[50,0,0]", "49")), Lines{});
  EXPECT_EQ(seen(R"({"type": "plane", "point": [0,-1,0], "normal": [0,1,0], "material": {}})"), Lines{});
  EXPECT_EQ(seen(R"({"type": "plane", "point": [0,0,9], "normal": [0,0,1], "material": {}})"),
            Lines{"/objects nothing_in_view"});
}

TEST(Warnings, NameObjectsBehindTheCamera) {
  EXPECT_EQ(warnings_with("", ", " + sphere_at("[0,1,9]", "1") + ", " + sphere_at("[0,1,19]", "1")),
            Lines{"/objects/1 behind_camera"});
  EXPECT_EQ(warnings_with("", ", " + sphere_at("[0,1,9]", "4")), Lines{});
  EXPECT_EQ(warnings_with("", ", " + sphere_at("[0,1,9]", "1", R"({"reflection": 0.5})")), Lines{});
}

TEST(Warnings, NameLightsWithinOpaqueSolids) {
  const std::string bulb = R"(, {"type": "sphere", "center": [5,5,0], "radius": 0.2})";
  EXPECT_EQ(warnings_with("", ", " + sphere_at("[5,5,0]", "0.25"), bulb), Lines{"/lights/1 light_enclosed"});
  EXPECT_EQ(warnings_with("", ", " + sphere_at("[5,5,0]", "0.15"), bulb), Lines{});
  EXPECT_EQ(warnings_with("", ", " + sphere_at("[5,5,0]", "0.25", R"({"transmission": 1})"), bulb), Lines{});
  EXPECT_EQ(warnings_with("", ", " + sphere_at("[5,5,0]", "90"), bulb), Lines{}) << "around the camera, too";
  EXPECT_EQ(warnings_with("", "", R"(, {"type": "sphere", "center": [5,5,0], "radius": 0.2, "visible": true})"),
            Lines{});
  const std::string box = R"(, {"type": "box", "min": [4,4,-1], "max": [6,6,1], "material": {}})";
  EXPECT_EQ(warnings_with("", box, bulb), Lines{"/lights/1 light_enclosed"});
}

TEST(Warnings, NameObjectsThatDoublesDoNotResolve) {
  const std::string camera = R"("camera": {"position": [1000000,0,1], "look_at": [1000000,0,0]})";
  const auto at_a_million = [&](const std::string& radius) {
    return warnings_of(R"({"version": 1, "ambient": 1, )" + camera + R"(, "objects": [)" +
                       sphere_at("[1000000,0,0]", radius) + "," + sphere_at("[1000000,0,0]", "0.5") + "]}");
  };
  EXPECT_EQ(at_a_million("2.5e-7"), Lines{"/objects/0 beyond_precision"}) << "spans less than 2^-40 of a million";
  EXPECT_EQ(at_a_million("2.7e-7"), Lines{});
}

TEST(Warnings, AreLimitedInNumber) {
  std::string materials;
  for (int i = 0; i < 150; ++i)
    materials += std::string(i ? "," : "") + "\"" + std::to_string(i) + R"(": {"color": 2})";
  EXPECT_EQ(warnings_with("\"materials\": {" + materials + "}").size(), tracer::warnings_max);
}

TEST(Warnings, ArePartOfTheReportAndOfTheValidation) {
  const tracer::Scene scene = accepted(camera_with(R"("fov": 0.8)")).scene;
  const std::string warning =
      R"("warnings":[{"pointer":"#/camera/fov","code":"radians","detail":"angles are in degrees, got 0.8: is it in radians?"}])";
  for (const std::string& text : {api::write_valid(scene, std::nullopt), api::write_report(scene, {}, {}, {}, {}, 0)})
    EXPECT_NE(text.find(warning), std::string::npos) << text;
  EXPECT_NE(api::write_invalid({}).find(R"("warnings":[])"), std::string::npos);
}

}  // namespace
