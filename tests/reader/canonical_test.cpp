/// Canonical text of documents, and the documents of a batch.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "api/batch.h"
#include "tests/reader/reading.h"

namespace {

std::string canonical(const std::string& document) {
  std::string text;
  const auto parsed = api::parse_scene(document, api::Limits{}, &text);
  EXPECT_TRUE(parsed) << document;
  return text;
}

const std::string camera = R"("camera": {"position": [0, 1, 6], "look_at": [0, 0, 0]})";

struct Taken {
  std::vector<std::string> documents;
  std::vector<std::string> issues;
};

Taken taken(const std::string& body, const api::BatchLimits& limits = {}) {
  Taken result;
  const auto batch = api::parse_batch(body, limits, [&](std::string document, api::Document, std::string) {
    result.documents.push_back(std::move(document));
  });
  if (batch) {
    EXPECT_EQ(batch->jobs, static_cast<int>(result.documents.size()));
    return result;
  }
  for (const tracer::Issue& issue : batch.error().issues) result.issues.push_back(issue.pointer + " " + issue.code);
  return result;
}

}  // namespace

TEST(CanonicalText, IsIndependentOfOrderAndSpelling) {
  const std::string text =
      canonical(R"({"version": 1, "name": "caf\u00e9", )" + camera + R"(, "ambient": [0.5, 1, 0]})");
  EXPECT_EQ(text,
            "{\"ambient\":[0.5,1,0],\"camera\":{\"look_at\":[0,0,0],\"position\":[0,1,6]},\"name\":\"caf\xC3\xA9\","
            "\"version\":1}");
  EXPECT_EQ(canonical(R"({"ambient":[5e-1,1.0,0e7],"name":"café","version":1e0,)" + camera + "}"), text);
}

TEST(CanonicalText, OmitsOnlyTheJob) {
  const std::string plain = canonical(R"({"version": 1, )" + camera + "}");
  EXPECT_EQ(canonical(R"({"version": 1, "job": {"priority": 3, "labels": {"job": "x"}}, )" + camera + "}"), plain);
  EXPECT_NE(canonical(R"({"version": 1, "name": "", )" + camera + "}"), plain);
  EXPECT_NE(canonical(R"({"version": 1, "ambient": [0, 0, 0], )" + camera + "}"), plain);
}

TEST(CanonicalText, EscapesStringsAndDistinguishesNeighboringDoubles) {
  EXPECT_NE(canonical(R"({"version": 1, "name": "a\"b\\c", )" + camera + "}").find(R"("name":"a\"b\\c")"),
            std::string::npos);
  EXPECT_NE(canonical(R"({"version": 1, "ambient": [0.1, 0, 0], )" + camera + "}"),
            canonical(R"({"version": 1, "ambient": [0.10000000000000002, 0, 0], )" + camera + "}"));
}

TEST(BatchReader, MergesFramesIntoTheScene) {
  const Taken batch = taken(R"({"scene": {"version": 1, "name": "a", )" + camera +
                            R"(}, "frames": [{}, {"name": null}, {"camera": {"fov": 30}}]})");
  ASSERT_EQ(batch.documents.size(), 3u);
  EXPECT_NE(batch.documents[0].find(R"("name":"a")"), std::string::npos);
  EXPECT_EQ(batch.documents[1].find("name"), std::string::npos);
  EXPECT_NE(batch.documents[2].find(R"("fov":30)"), std::string::npos);
}

TEST(BatchReader, VariesTheLastPointerOfASweepFastest) {
  const Taken batch =
      taken(R"({"scene": {"version": 1, )" + camera + R"(}, "sweep": {"/camera/fov": [30, 40], "/name": ["x", "y"]}})");
  ASSERT_EQ(batch.documents.size(), 4u);
  EXPECT_NE(batch.documents[1].find(R"("fov":30},"name":"y")"), std::string::npos) << batch.documents[1];
  EXPECT_NE(batch.documents[2].find(R"("fov":40},"name":"x")"), std::string::npos) << batch.documents[2];
}

TEST(BatchReader, ReportsIssuesWithTheirPointers) {
  using Issues = std::vector<std::string>;
  const std::string scene = R"({"scene": {"version": 1, )" + camera + "}, ";
  EXPECT_EQ(taken(scene + R"("frames": [{"camera": null}]})").issues, (Issues{"/frames/0/camera missing_field"}));
  EXPECT_EQ(taken(scene + R"("sweep": {"/camera/fov": [-1, 30]}})").issues, (Issues{"/scene/camera/fov out_of_range"}));
  EXPECT_EQ(taken(scene + R"("sweep": {"/a~b": [1]}})").issues, (Issues{"/sweep/~1a~0b malformed"}));
  EXPECT_EQ(taken(scene + R"("sweep": {"": [1]}})").issues, (Issues{"/sweep/ unknown_reference"}));
  EXPECT_EQ(taken("7").issues, (Issues{" wrong_type"}));
  EXPECT_EQ(taken(scene + R"("frames": [{"ambient": [1e999, 0, 0]}]})").issues, (Issues{" not_finite"}));
}

TEST(BatchReader, RejectsTooManyDocumentsOrBytes) {
  api::BatchLimits limits;
  limits.jobs = 3;
  const std::string scene = R"({"scene": {"version": 1, )" + camera + "}, ";
  EXPECT_TRUE(taken(scene + R"("frames": [{}, {}, {}]})", limits).issues.empty());
  EXPECT_EQ(taken(scene + R"("frames": [{}, {}, {}, {}]})", limits).issues,
            std::vector<std::string>{"/frames limit_exceeded"});
  EXPECT_EQ(taken(scene + R"("sweep": {"/name": ["a", "b"], "/camera/fov": [30, 40]}})", limits).issues,
            std::vector<std::string>{"/sweep limit_exceeded"});
  limits.all_bytes = 100;
  EXPECT_EQ(taken(scene + R"("frames": [{}, {}]})", limits).issues,
            std::vector<std::string>{"/frames/1 limit_exceeded"});
}
