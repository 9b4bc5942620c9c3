/// Issues: their texts, their order, and the omission of issues that follow from others.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/reader/reading.h"

namespace {

using reader_tests::document_with;
using reader_tests::document_with_object;
using reader_tests::only_detail;
using reader_tests::outcome;
using Lines = std::vector<std::string>;

TEST(IssueText, SuggestsTheLikelyField) {
  EXPECT_EQ(only_detail(document_with(R"("nmae": "x")")),
            "\"nmae\" is not a field of the document; did you mean \"name\"?");
  EXPECT_EQ(only_detail(document_with(R"("image": {"Width": 3})")),
            "\"Width\" is not a field of the image; did you mean \"width\"?");
  EXPECT_EQ(only_detail(document_with(R"("image": {"quux": 1})")),
            "\"quux\" is not a field of the image; its fields are \"width\", \"height\", \"crop\"");
}

TEST(IssueText, SuggestsTheLikelyName) {
  const std::string plane = R"({"type": "plane", "point": [0,0,0], "normal": [0,1,0], "material": "glas"})";
  EXPECT_EQ(only_detail(document_with(R"("materials": {"gloss": {}, "glass": {}}, "objects": [)" + plane + "]")),
            "\"glas\" is not defined; did you mean \"glass\"?");
  EXPECT_EQ(only_detail(document_with(R"("objects": [)" + plane + "]")),
            "\"glas\" is not defined: define it in \"materials\": {\"glas\": ...}");
  EXPECT_EQ(only_detail(document_with(R"("materials": {"ivory": {}, "wood": {}}, "objects": [)" + plane + "]")),
            "\"glas\" is not defined; defined are \"ivory\", \"wood\"");
}

TEST(IssueText, SuggestsTheLikelyWordAndListsAll) {
  EXPECT_EQ(
      only_detail(document_with(R"("materials": {"m": {"model": "blinn-phong"}})")),
      "must be one of \"lambert\", \"phong\", \"blinn_phong\", got \"blinn-phong\"; did you mean \"blinn_phong\"?");
}

TEST(IssueText, NamesTheFormOfWordsFromOtherPrograms) {
  const std::pair<std::string, std::string> cases[] = {
      {R"("image": {"spp": 16})", R"("spp" is not a field of the image; write "accuracy": {"samples": N})"},
      {R"("fog": {})", R"(; write "depth_cue": {"front": Z, "back": Z, "color": COLOUR})"},
      {R"("materials": {"m": {"alpha": 0.5}})", R"(write "opacity")"},
      {R"("materials": {"m": {"Roughness": 0.5}})", R"(write "specular" (0 to 1) and "shininess")"},
      {R"("materials": {"m": {"kd": 0.5}})", R"(write "diffuse" (a factor) and "color")"},
      {R"("materials": {"m": {"base_color": 0.5}})", R"(write "color")"},
      {R"("ambient": {"hsb": [0, 1, 1], "hsv": [0, 1, 1]})", R"(write {"hsb": [hue, saturation, brightness]})"},
      {R"("textures": {"t": {"checker": [0, 1], "repeat": 2}})", R"(write "scale": repetitions)"},
      {R"("lights": [{"type": "spot", "position": [0,0,0], "direction": [0,1,0], "inner_angle": 1, "outer_angle": 2,
                      "castShadow": true}])",
       R"("castShadow" is not a field of a spot light; write "shadows")"},
      {R"("lights": [{"type": "sun"}])", R"(got "sun"; write "directional")"},
      {R"("objects": [{"type": "cube", "material": {}}])", R"(got "cube"; write "box")"}};
  for (const auto& [members, form] : cases) {
    const std::string detail = only_detail(document_with(members));
    EXPECT_NE(detail.find(form), std::string::npos) << detail;
  }
}

TEST(IssueText, NamesTheFormOfMissingAndMisshapenValues) {
  EXPECT_EQ(only_detail(R"({"version": 1})"),
            R"(the document must have "camera": {"position": [x, y, z], "look_at": [x, y, z]})");
  EXPECT_EQ(only_detail(R"({"version": "1.0", "camera": {"position": [0,1,6], "look_at": [0,0,0]}})"),
            R"(must be the number 1, got the string "1.0")");
  EXPECT_EQ(only_detail(document_with_object("sphere", R"("center": {"x": 1}, "radius": 1)")),
            "must be [x, y, z], got an object");
  EXPECT_EQ(only_detail(document_with_object("sphere", R"("radius": 1)")), R"(a sphere must have "center": [x, y, z])");
  EXPECT_EQ(only_detail(document_with(R"("lights": [{}])")),
            R"(a light must have "type": "point", "directional", "spot", "line", "rect", "disc", "sphere")");
  EXPECT_EQ(only_detail(document_with(R"("ambient": [1, 1, 1, 1])")), "must be [r, g, b], got an array of 4");
  EXPECT_EQ(only_detail(document_with(R"("lights": {})")),
            R"(must be a list of lights: [{"type": "point", "position": [x, y, z]}, ...], got an object)");
  EXPECT_EQ(only_detail(document_with(R"("lights": [1])")),
            R"(must be an object such as {"type": "point", "position": [x, y, z]}, got the number 1)");
  EXPECT_EQ(only_detail(document_with(R"("materials": [])")),
            R"(must be an object of definitions by name: {"NAME": ...}, got an array of 0)");
  EXPECT_EQ(only_detail("[]"),
            R"(must be an object: {"version": 1, "camera": {...}, "objects": [...]}, got an array of 0)");
}

TEST(IssueText, ReportsNumbersWithoutInnerBracketsOnce) {
  EXPECT_EQ(only_detail(document_with_object("mesh", R"("positions": [0,0,0, 1,0,0, 0,1,0], "triangles": [[0,1,2]])")),
            "must be a list of lists, [[x, y, z], ...], got 9 numbers without inner brackets");
  const std::string positions = R"("positions": [[0,0,0],[1,0,0],[0,1,0]], )";
  EXPECT_EQ(only_detail(document_with_object("mesh", positions + R"("triangles": [0,1,2])")),
            "must be a list of lists, [[0, 1, 2], ...], got 3 numbers without inner brackets");
  EXPECT_EQ(only_detail(document_with_object("mesh", positions + R"("faces": [0,1,2])")),
            "must be a list of lists, [[0, 1, 2, 3], ...], got 3 numbers without inner brackets");
}

TEST(IssueText, NamesTheRuleAndTheValue) {
  EXPECT_EQ(only_detail(document_with_object("sphere", R"("center": [0,0,0], "radius": -1)")), "must be > 0, got -1");
  EXPECT_EQ(only_detail(document_with(R"("image": {"width": 3.9})")), "must be an integer, got the number 3.9");
  EXPECT_EQ(only_detail(document_with(R"("image": "big")")),
            "must be an object with \"width\", \"height\", \"crop\", got the string \"big\"");
  EXPECT_EQ(only_detail(document_with(R"("image": {"width": 70000})")), "the limit image_side is 65536, got 70000");
  EXPECT_EQ(only_detail(document_with(R"("job": {"deadline": "noon"})")),
            "must be a time such as \"2030-01-31T18:00:00Z\" (RFC 3339, 1970 to 9999), got \"noon\"");
}

TEST(IssueText, ShortensAndEscapesQuotedText) {
  const std::string long_name(200, 'x');
  EXPECT_EQ(
      only_detail(document_with("\"image\": \"" + long_name + "\"")),
      "must be an object with \"width\", \"height\", \"crop\", got the string \"" + std::string(64, 'x') + "...\"");
  std::string accents;  // 2 bytes each after one byte: the cut falls within a character
  for (int i = 0; i < 60; ++i) accents += "\xC3\xA9";
  EXPECT_EQ(
      only_detail(document_with("\"image\": \"x" + accents + "\"")),
      "must be an object with \"width\", \"height\", \"crop\", got the string \"x" + accents.substr(0, 62) + "...\"");
  EXPECT_EQ(only_detail(document_with(R"("image": "a\u0000\u001b[31m")")),
            "must be an object with \"width\", \"height\", \"crop\", got the string \"a??[31m\"");
}

TEST(IssueOrder, IsThatOfTheDocument) {
  EXPECT_EQ(outcome(R"({"objects": [{"type": "plane", "normal": [0,0,0], "point": [0,0], "material": "x"}], "typo": 1,
                        "materials": {"b": {"ior": 0}, "a": {"ior": 0}}, "version": 1,
                        "camera": {"fov": 0, "look_at": [0,0,0], "position": [0,"1",0]}})"),
            (Lines{"/objects/0/normal degenerate", "/objects/0/point wrong_length",
                   "/objects/0/material unknown_reference", "/typo unknown_field", "/materials/b/ior out_of_range",
                   "/materials/a/ior out_of_range", "/camera/fov out_of_range", "/camera/position/1 wrong_type"}));
}

TEST(IssueOrder, OfArrayElementsIsNumerical) {
  std::string lights;
  Lines expected;
  for (int i = 0; i < 12; ++i) {
    lights += std::string(i ? "," : "") + R"({"type": "point", "position": [0,0,0], "intensity": -1})";
    expected.push_back("/lights/" + std::to_string(i) + "/intensity out_of_range");
  }
  EXPECT_EQ(outcome(document_with("\"lights\": [" + lights + "]")), expected);
}

TEST(IssueSuppression, OmitsIssuesThatFollowFromInvalidValues) {
  EXPECT_EQ(outcome(R"({"version": 1, "camera": {}})"),
            (Lines{"/camera/position missing_field", "/camera/look_at missing_field"}));
  EXPECT_EQ(outcome(R"({"version": 1, "camera": {"position": [0,0,0], "look_at": [0,1,0], "up": "y"}})"),
            (Lines{"/camera/up wrong_type"}));
  EXPECT_EQ(outcome(document_with_object("sphere",
                                         R"("center": [0,0,0], "radius": "1", "axis": [1,0,0], "meridian": [1,0])")),
            (Lines{"/objects/0/radius wrong_type", "/objects/0/meridian wrong_length"}));
  EXPECT_EQ(outcome(document_with_object("mesh", R"("positions": "many", "triangles": [[0,1,2]], "uvs": [[0,0]])")),
            (Lines{"/objects/0/positions wrong_type"}));
  EXPECT_EQ(outcome(document_with(R"("output": {"formats": ["gif"]})")), (Lines{"/output/formats/0 unknown_value"}));
}

TEST(IssueSuppression, KeepsOtherIssuesOfTheSameObject) {
  EXPECT_EQ(outcome(document_with_object("mesh",
                                         R"("positions": [[0,0,0],[1,0],[0,1,0]], "triangles": [[0,1,3]], "tint": 1)")),
            (Lines{"/objects/0/positions/1 wrong_length", "/objects/0/triangles/0/2 out_of_range",
                   "/objects/0/tint unknown_field"}));
}

TEST(IssueSuppression, KeepsExceededLimits) {
  api::Limits limits;
  limits.scene.triangles = 1;
  EXPECT_EQ(outcome(document_with_object(
                        "mesh", R"("positions": [[0,0,0],[1,0,0],[0,1,0]], "triangles": [[0,1,2],[0,2,1]], "x": 1)"),
                    limits),
            (Lines{"/objects limit_exceeded", "/objects/0/x unknown_field"}));
}

TEST(SceneLimits, AreEnforced) {
  const std::string plane =
      R"({"type": "plane", "point": [0,0,0], "normal": [0,1,0], "material": {"color": {"checker": [0, 1]}}})";
  const std::string light = R"({"type": "point", "position": [0,0,0]})";
  const std::string document = document_with(
      R"("image": {"width": 8, "height": 8}, "accuracy": {"samples": [2, 2], "max_depth": 3}, "lights": [)" + light +
      "," + light + R"(], "objects": [)" + plane + "," + plane + "]");
  const auto with = [&](auto change) {
    api::Limits limits;
    change(limits);
    return outcome(document, limits);
  };
  EXPECT_EQ(with([](api::Limits&) {}), Lines{"accepted"});
  EXPECT_EQ(with([](api::Limits& l) { l.scene.pixels = 63; }), Lines{"/image limit_exceeded"});
  EXPECT_EQ(with([](api::Limits& l) { l.scene.image_side = 7; }),
            (Lines{"/image/width limit_exceeded", "/image/height limit_exceeded"}));
  EXPECT_EQ(with([](api::Limits& l) { l.scene.samples_times_pixels = 127; }),
            Lines{"/accuracy/samples limit_exceeded"});
  EXPECT_EQ(with([](api::Limits& l) { l.scene.max_depth = 2; }), Lines{"/accuracy/max_depth limit_exceeded"});
  EXPECT_EQ(with([](api::Limits& l) { l.scene.lights = 1; }), Lines{"/lights limit_exceeded"});
  EXPECT_EQ(with([](api::Limits& l) { l.scene.objects = 1; }), Lines{"/objects limit_exceeded"});
  EXPECT_EQ(with([](api::Limits& l) { l.scene.materials = 1; }), Lines{"/objects/1/material limit_exceeded"});
  EXPECT_EQ(with([](api::Limits& l) { l.scene.textures = 1; }), Lines{"/objects/1/material/color limit_exceeded"});
  EXPECT_EQ(with([&](api::Limits& l) { l.document.bytes = document.size() - 1; }), Lines{"too_large"});
  EXPECT_EQ(with([](api::Limits& l) { l.document.depth = 5; }), Lines{"too_large"});
  EXPECT_EQ(with([](api::Limits& l) { l.document.depth = 6; }), Lines{"accepted"});
  EXPECT_EQ(with([](api::Limits& l) { l.document.key_bytes = 8; }), Lines{"too_large"});
  EXPECT_EQ(with([](api::Limits& l) { l.document.string_bytes = 4; }), Lines{"too_large"});
  EXPECT_EQ(with([](api::Limits& l) { l.document.values = 60; }), Lines{"too_large"});
}

TEST(SceneLimits, AreNamedWithTheValueInIssues) {
  api::Limits limits;
  limits.document.depth = 2;
  EXPECT_EQ(api::parse_scene("[[[", limits).error().detail, "the limit depth is 2, the document has 3");
  limits.document.bytes = 2;
  EXPECT_EQ(api::parse_scene("[[[", limits).error().detail, "the limit bytes is 2, the document has 3");
}

TEST(SceneReader, CountsIssuesAboveAThousand) {
  std::string lights;
  for (int i = 0; i < 1500; ++i)
    lights += std::string(i ? "," : "") + R"({"type": "point", "position": [0,0,0], "intensity": -1})";
  const auto document = api::parse_scene(document_with("\"lights\": [" + lights + "]"), {});
  ASSERT_FALSE(document);
  const auto& issues = document.error().issues;
  ASSERT_EQ(issues.size(), 1001u);
  EXPECT_EQ(issues[999].pointer, "/lights/999/intensity");
  EXPECT_EQ(issues[1000].code, "too_many_issues");
  EXPECT_EQ(issues[1000].detail, "and 500 more");
}

}  // namespace
