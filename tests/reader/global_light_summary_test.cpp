/// The sentence about the light that the global model adds to a scene.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/reader/reading.h"
#include "tracer/requirements.h"

namespace {

using reader_tests::accepted;
using reader_tests::document_with;

/// Spheres of these materials, and `members`.
std::string global_summary_of(const std::vector<std::string>& materials, const std::string& members = {}) {
  std::string defined, objects;
  for (std::size_t i = 0; i < materials.size(); ++i) {
    const std::string name = "m" + std::to_string(i), separator = i == 0 ? "" : ", ";
    defined += separator + '"' + name + "\": " + materials[i];
    objects += separator + R"({"type": "sphere", "center": [0,0,0], "radius": 1, "material": ")" + name + "\"}";
  }
  return tracer::global_light_summary(accepted(document_with(R"("materials": {)" + defined + R"(}, "objects": [)" +
                                                             objects + "]" + (members.empty() ? "" : ", ") + members))
                                          .scene);
}

TEST(GlobalLightSummary, BoundsTheLightByTheBrightestDiffuseSurface) {
  EXPECT_EQ(
      global_summary_of({R"({"model": "lambert", "color": [0.8, 0, 0]})", R"({"model": "lambert", "color": 0.5})",
                         R"({"color": [0.8, 0, 0], "diffuse": 1})"}),
      "adds light between surfaces of 2 diffuse colors that reflect up to 0.8, at most 4 times the brightest light "
      "without it");
  EXPECT_EQ(
      global_summary_of({R"({"color": 0.5, "diffuse": 1, "reflection": 0.25})"}),
      "adds light between surfaces of 1 diffuse color that reflect up to 0.5, at most 2 times the brightest light "
      "without it");
}

TEST(GlobalLightSummary, IgnoresMirrorsAndGlassWithoutDiffuseLight) {
  const std::string mirror = R"({"diffuse": 0, "reflection": 1})";
  EXPECT_EQ(global_summary_of({mirror, R"({"diffuse": 0, "transmission": 1, "ior": 1.5})"}),
            "adds nothing: no surface reflects light diffusely");
  EXPECT_EQ(global_summary_of({mirror, R"({"model": "lambert", "color": 0.5})"}),
            global_summary_of({R"({"model": "lambert", "color": 0.5})"}));
}

TEST(GlobalLightSummary, HasNoBoundForWhite) {
  EXPECT_NE(global_summary_of({R"({"model": "lambert", "color": 1})"}).find("reflect up to 1, without an upper bound"),
            std::string::npos);
}

TEST(GlobalLightSummary, BoundsTexturesByTheirColors) {
  const std::string textures = R"("textures": {"squares": {"checker": [0.2, 0.75]}})";
  EXPECT_NE(
      global_summary_of({R"({"model": "lambert", "color": "squares"})"}, textures).find("up to 0.75, at most 3 times"),
      std::string::npos);
}

TEST(GlobalLightSummary, NamesGlowingSurfacesAndTheBackground) {
  const std::string grey = R"({"model": "lambert", "color": 0.5})", lamp = R"({"diffuse": 0, "emission": 2})";
  EXPECT_TRUE(global_summary_of({grey, lamp}).ends_with("; glowing surfaces light others (/materials/m1)"));
  EXPECT_TRUE(
      global_summary_of({grey}, R"("background": {"color": 0.2})").ends_with("; the background lights surfaces"));
  EXPECT_EQ(global_summary_of({grey}).find("background"), std::string::npos);
}

TEST(GlobalLightSummary, NamesAMaterialThatTheModelRefuses) {
  EXPECT_TRUE(global_summary_of({R"({"color": 1, "diffuse": 0.02, "transmission": 1, "ior": 1.5})"})
                  .starts_with("not possible: /materials/m0 gives back "));
}

/// A diffuse image file beside a mirror of this reflection.
std::string with_image_and_reflection(const std::string& reflection) {
  return R"({"color": {"file": "a.png"}, "diffuse": 1, "reflection": )" + reflection + "}";
}

TEST(GlobalLightSummary, StatesAnImageFileThatMayMakeTheModelImpossible) {
  const std::string sentence = global_summary_of({with_image_and_reflection("0.25")});
  EXPECT_TRUE(sentence.starts_with("adds light between surfaces of 1 diffuse color"));
  EXPECT_TRUE(
      sentence.ends_with("; not possible if an image file is white: /materials/m0 then gives back more light than it "
                         "receives"));
  EXPECT_EQ(global_summary_of({with_image_and_reflection("0")}).find("image file"), std::string::npos);
}

TEST(SceneReader, LeavesItToImageFilesHowMuchLightTheyGiveBack) {
  const auto issues_with = [](const std::string& reflection) {
    return reader_tests::outcome(document_with(R"("materials": {"m": )" + with_image_and_reflection(reflection) +
                                               R"(}, "objects": [{"type": "sphere", "center": [0,0,0], "radius": 1, )" +
                                               R"("material": "m"}], "accuracy": {"model": "global"})"));
  };
  EXPECT_EQ(issues_with("0.25"), std::vector<std::string>{"accepted"});
  EXPECT_EQ(issues_with("1"), std::vector<std::string>{"accepted"});
}

}  // namespace
