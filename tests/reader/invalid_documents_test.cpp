/// Every document of the tables in tests/reader/invalid has exactly the listed issues and sentences, or warnings; their
/// bases are accepted. Issues and limits that depend on numbers of elements.

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "tests/reader/reading.h"

namespace {

using namespace reader_tests;
using Lines = std::vector<std::string>;

TEST(InvalidDocuments, HaveExactlyTheListedIssues) {
  std::set<std::string> names;
  for (const auto& document : invalid_documents()) {
    if (document.outcome[0] == "warnings") {
      EXPECT_EQ(warnings_of(document.text), Lines(document.outcome.begin() + 1, document.outcome.end()))
          << document.name;
    } else {
      EXPECT_EQ(outcome(document), document.outcome) << document.name << ": " << document.text;
    }
    if (!document.detail.empty()) {
      EXPECT_EQ(only_detail(document.text), document.detail) << document.name;
    }
    EXPECT_TRUE(document.name.ends_with(".base") || names.insert(document.name).second) << document.name << " twice";
  }
  EXPECT_GE(names.size(), 900u);
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

TEST(SceneReader, ListsAThousandIssuesInTheOrderOfElementsAndCountsTheOthers) {
  std::string lights;
  for (int i = 0; i < 1500; ++i)
    lights += std::string(i ? "," : "") + R"({"type": "point", "position": [0,0,0], "intensity": -1})";
  const auto document = api::parse_scene(document_with("\"lights\": [" + lights + "]"), {});
  ASSERT_FALSE(document);
  const auto& issues = document.error().issues;
  ASSERT_EQ(issues.size(), 1001u);
  for (std::size_t i = 0; i < 1000; ++i) EXPECT_EQ(issues[i].pointer, "/lights/" + std::to_string(i) + "/intensity");
  EXPECT_EQ(issues[1000], (tracer::Issue{"", "too_many_issues", "and 500 more"}));
}

}  // namespace
