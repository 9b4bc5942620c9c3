/// The sentence about the light that the global model adds to a scene.

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "tests/reader/reading.h"
#include "tracer/requirements.h"

namespace {

using namespace reader_tests;

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

TEST(GlobalLightSummary, BoundsTexturesByTheirColorsAndHasNoBoundForWhite) {
  const auto bound_of = [](const std::string& color) {
    const std::string sentence = global_summary_of({R"({"model": "lambert", "color": )" + color + "}"});
    return sentence.substr(sentence.find("up to "));
  };
  EXPECT_EQ(bound_of(R"({"checker": [0.2, 0.75]})"), "up to 0.75, at most 3 times the brightest light without it");
  EXPECT_EQ(bound_of("1"), "up to 1, without an upper bound");
}

TEST(GlobalLightSummary, NamesGlowingSurfacesAndTheBackground) {
  const std::string grey = R"({"model": "lambert", "color": 0.5})", lamp = R"({"diffuse": 0, "emission": 2})";
  EXPECT_TRUE(global_summary_of({grey, lamp}).ends_with("; glowing surfaces light others (/materials/m1)"));
  EXPECT_TRUE(
      global_summary_of({grey}, R"("background": {"color": 0.2})").ends_with("; the background lights surfaces"));
  EXPECT_EQ(global_summary_of({grey}).find("background"), std::string::npos);
}

/// Boxes as the walls of a room from (-2, 0, -2) to (2, 3, 2) on these sides; the camera is at (0, 1, z) and looks
/// along the z axis.
std::string summary_of_room(const std::vector<const char*>& sides, double z) {
  const std::map<std::string, const char*> boxes{
      {"left", R"("min": [-2,0,-2], "max": [-1.99,3,2])"}, {"right", R"("min": [1.99,0,-2], "max": [2,3,2])"},
      {"floor", R"("min": [-2,0,-2], "max": [2,0.01,2])"}, {"ceiling", R"("min": [-2,2.99,-2], "max": [2,3,2])"},
      {"back", R"("min": [-2,0,-2], "max": [2,3,-1.99])"}, {"front", R"("min": [-2,0,1.99], "max": [2,3,2])"},
      {"table", R"("min": [-1,0,-1], "max": [1,1,-0.5])"}};
  std::string objects;
  for (const char* side : sides)
    objects +=
        (objects.empty() ? "" : ", ") + (R"({"type": "box", "material": "wall", )" + std::string(boxes.at(side))) + "}";
  const std::string document = R"({"version": 1, "camera": {"position": [0, 1, )" + std::to_string(z) +
                               R"(], "look_at": [0, 1, -9]}, "objects": [)" + objects +
                               R"(], "materials": {"wall": {"model": "lambert", "color": 0.5}}})";
  return tracer::global_light_summary(accepted(document).scene);
}

TEST(GlobalLightSummary, StatesARoomAroundTheCamera) {
  const auto enclosure_of = [](std::vector<const char*> sides, double z) {
    sides.insert(sides.end(), {"left", "right", "floor", "table"});
    const std::string sentence = summary_of_room(sides, z);
    if (sentence.find(" in a closed room, ") != std::string::npos) return "closed";
    return sentence.find(" in a room with an open side, ") != std::string::npos ? "open" : "none";
  };
  EXPECT_STREQ(enclosure_of({"ceiling", "back", "front"}, 1), "closed");
  EXPECT_STREQ(enclosure_of({"ceiling", "back", "front"}, 5), "none") << "from outside";
  EXPECT_STREQ(enclosure_of({"ceiling", "back"}, 1), "open");
  EXPECT_STREQ(enclosure_of({"ceiling", "back"}, 5), "open") << "through the open side";
  EXPECT_STREQ(enclosure_of({"ceiling", "front"}, 5), "none") << "from behind a wall";
  EXPECT_STREQ(enclosure_of({"back"}, 1), "none") << "two open sides";
}

TEST(GlobalLightSummary, StatesARoomOfPlanesAndOfASphere) {
  const auto sentence = [](const std::string& objects) {
    return tracer::global_light_summary(
        accepted(R"({"version": 1, "camera": {"position": [0, 1, 1], "look_at": [0, 1, -9]}, "objects": [)" + objects +
                 "]}")
            .scene);
  };
  std::string planes = R"({"type": "sphere", "center": [0, 1, -1], "radius": 0.5, "material": {"color": 0.5}})";
  for (const char* plane :
       {R"([0,0,0], "normal": [0,1,0])", R"([0,3,0], "normal": [0,1,0])", R"([-2,0,0], "normal": [1,0,0])",
        R"([2,0,0], "normal": [1,0,0])", R"([0,0,-3], "normal": [0,0,1])"})
    planes += R"(, {"type": "plane", "material": {"color": 0.5}, "point": )" + std::string(plane) + "}";
  EXPECT_NE(sentence(planes).find(" in a room with an open side, "), std::string::npos);
  const std::string sphere = R"({"type": "sphere", "radius": 3, "material": {"color": 0.5}, "center": )";
  EXPECT_NE(sentence(sphere + "[0, 0, 0]}").find(" in a closed room, "), std::string::npos);
  EXPECT_EQ(sentence(sphere + "[0, 0, -9]}").find("room"), std::string::npos);
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
  for (const char* reflection : {"0.25", "1"})
    accepted(document_with(R"("accuracy": {"model": "global"}, "objects": [{"type": "sphere", "center": [0,0,0],
                               "radius": 1, "material": )" +
                           with_image_and_reflection(reflection) + "}]"));
}

}  // namespace
