/// Digests of documents, and the documents of a batch.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "api/batch.h"
#include "tests/reader/reading.h"
#include "tracer/sha256.h"

namespace {

api::Digests digests(const std::string& document) {
  api::Digests result;
  const auto parsed = api::parse_scene(document, api::Limits{}, &result);
  EXPECT_TRUE(parsed) << document;
  return result;
}

const std::string camera = R"("camera": {"position": [0, 1, 6], "look_at": [0, 0, 0]})";

struct Taken {
  std::vector<api::Frame> frames;
  std::vector<std::string> documents;  ///< complete
  std::vector<std::string> issues;
};

Taken taken(const std::string& body, const api::BatchLimits& limits = {}) {
  Taken result;
  const auto batch =
      api::parse_batch(body, limits, [&](api::Frame frame) { result.frames.push_back(std::move(frame)); });
  if (batch) {
    EXPECT_EQ(batch->jobs, static_cast<int>(result.frames.size()));
    for (const api::Frame& frame : result.frames) {
      result.documents.push_back(api::apply_patch(batch->scene, frame.patch).value());
    }
    return result;
  }
  result.issues = reader_tests::issue_lines(batch.error().issues);
  return result;
}

}  // namespace

TEST(Digests, AreIndependentOfOrderAndSpelling) {
  const api::Digests first =
      digests(R"({"version": 1, "name": "caf\u00e9", )" + camera + R"(, "ambient": [0.5, 1, 0]})");
  EXPECT_EQ(first, (api::Digests{{"ambient", tracer::sha256_hex("[0.5,1,0]")},
                                 {"camera", tracer::sha256_hex(R"({"look_at":[0,0,0],"position":[0,1,6]})")},
                                 {"name", tracer::sha256_hex("\"caf\xC3\xA9\"")},
                                 {"version", tracer::sha256_hex("1")}}));
  EXPECT_EQ(digests(R"({"ambient":[5e-1,1.0,0e7],"name":"café","version":1e0,)" + camera + "}"), first);
}

TEST(Digests, OmitOnlyTheJob) {
  const api::Digests plain = digests(R"({"version": 1, )" + camera + "}");
  EXPECT_EQ(digests(R"({"version": 1, "job": {"priority": 3, "labels": {"job": "x"}}, )" + camera + "}"), plain);
  EXPECT_NE(digests(R"({"version": 1, "name": "", )" + camera + "}"), plain);
  EXPECT_NE(digests(R"({"version": 1, "ambient": [0, 0, 0], )" + camera + "}"), plain);
}

TEST(Digests, AreComputedOnlyForScenesWithPatchesIfTheseAreWanted) {
  const auto count = [](const std::string& accuracy) {
    api::Digests result;
    EXPECT_TRUE(api::parse_scene(R"({"version": 1, "accuracy": )" + accuracy + ", " + camera + "}", api::Limits{},
                                 &result, api::DigestsOf::scenes_with_patches));
    return result.size();
  };
  EXPECT_EQ(count(R"({"model": "global"})"), 0u);
  EXPECT_EQ(count(R"({"model": "global", "approximate": {"interreflection": "radiosity"}})"), 3u);
}

TEST(Digests, EscapeStringsAndDistinguishNeighboringDoubles) {
  EXPECT_EQ(digests(R"({"version": 1, "name": "a\"b\\c", )" + camera + "}").at("name"),
            tracer::sha256_hex(R"("a\"b\\c")"));
  EXPECT_NE(digests(R"({"version": 1, "ambient": [0.1, 0, 0], )" + camera + "}"),
            digests(R"({"version": 1, "ambient": [0.10000000000000002, 0, 0], )" + camera + "}"));
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
  EXPECT_EQ(taken(scene + R"("frames": [{}, {"name": "a name that is long enough for the limit"}]})", limits).issues,
            std::vector<std::string>{"/frames/1 limit_exceeded"});
}

namespace {

/// Members of every kind, with 100 objects.
std::string long_scene() {
  std::string objects;
  for (int i = 0; i < 100; ++i) {
    objects += std::string(i > 0 ? "," : "") + R"({"type": "sphere", "radius": 1, "center": [)" + std::to_string(i) +
               R"(, 0, 0], "material": "red"})";
  }
  return R"({"version": 1, "name": "s", "image": {"width": 8, "height": 6}, )" + camera +
         R"(, "textures": {"t": {"checker": [0, 1]}}, "materials": {"red": {"color": "t"}}, "objects": [)" + objects +
         R"(], "lights": [{"type": "point", "position": [1, 2, 3]}], "ambient": [0, 0, 0],)"
         R"( "accuracy": {"samples": [1, 1]}, "job": {"labels": {"a": "b"}}})";
}

/// Patches, the scene complete or in parts.
const std::vector<std::string> patches{
    "{}",
    R"({"camera": {"fov": 30}})",
    R"({"camera": {"fov": -1}})",
    R"({"camera": null})",
    R"({"camera": {"fob": 30}})",
    R"({"cameras": {}})",
    R"({"version": 2})",
    R"({"name": null, "job": null})",
    R"({"job": {"priority": 70, "labels": {"c": "d"}}})",
    R"({"job": {"priority": 700}})",
    R"({"image": {"width": 4000, "height": 4000}, "accuracy": {"samples": [100, 100]}})",
    R"({"image": {"width": 0}})",
    R"({"image": {"width": 60000, "height": 60000}})",
    R"({"accuracy": null})",
    R"({"accuracy": {"samples": [1, 9], "time_budget_ms": 5}})",
    R"({"lights": []})",
    R"({"lights": null})",
    R"({"lights": [{"type": "point", "position": [1, 2]}]})",
    R"({"ambient": "#123456"})",
    R"({"ambient": [1, 2]})",
    R"({"depth_cue": {"front": 1, "back": 2}})",
    R"({"depth_cue": {"front": 3, "back": 2}})",
    R"({"output": {"formats": ["png", "exr"], "layers": ["depth"]}})",
    R"({"output": {"formats": []}})",
    R"({"background": {"color": "t"}})",
    R"({"background": {"color": [0, 0, 1]}})",
    R"({"materials": null})",
    R"({"materials": {"red": {"color": "none"}}})",
    R"({"materials": {"blue": {"reflection": 2}}})",
    R"({"textures": {"t": null}})",
    R"({"objects": null})",
    R"({"objects": [{"type": "sphere", "radius": -1, "center": [0, 0, 0]}]})",
    R"({"objects": [], "camera": {"fov": 1000}})",
};

}  // namespace

/// The oracle is the document as it would be submitted alone.
TEST(BatchReader, ReadsFramesInPartsAsTheCompleteDocument) {
  int in_parts = 0;
  for (const std::string& patch : patches) {
    SCOPED_TRACE(patch);
    const std::string document = api::apply_patch(long_scene(), patch).value();
    api::Digests expected_digests;
    const auto expected = api::parse_scene(document, api::Limits{}, &expected_digests);
    const Taken batch = taken(R"({"scene": )" + long_scene() + R"(, "frames": [{}, )" + patch + "]}");
    if (!expected) {
      std::vector<std::string> issues;
      for (const tracer::Issue& issue : expected.error().issues)
        issues.push_back("/frames/1" + issue.pointer + " " + issue.code);
      EXPECT_EQ(batch.issues, issues);
      continue;
    }
    ASSERT_EQ(batch.frames.size(), 2u);
    const api::Frame& frame = batch.frames[1];
    in_parts += frame.complete ? 0 : 1;
    const tracer::Scene &scene = frame.document.scene, &complete = expected->scene;
    EXPECT_EQ(frame.digests, expected_digests);
    EXPECT_EQ(api::estimated_memory_bytes(scene, frame.content), api::estimated_memory_bytes(complete));
    EXPECT_EQ(api::is_large(scene, frame.content), api::is_large(complete));
    EXPECT_EQ(scene.image.width, complete.image.width);
    EXPECT_EQ(scene.accuracy.samples, complete.accuracy.samples);
    EXPECT_EQ(scene.accuracy.adaptive.has_value(), complete.accuracy.adaptive.has_value());
    EXPECT_EQ(scene.output.formats, complete.output.formats);
    EXPECT_EQ(frame.document.job.labels, expected->job.labels);
    EXPECT_EQ(frame.document.job.priority, expected->job.priority);
    EXPECT_EQ(frame.document.job.name, expected->job.name);
  }
  EXPECT_GE(in_parts, 10);
}

TEST(BatchReader, ReadsOnlyWhatAPatchChanges) {
  api::BatchLimits limits;
  limits.all_values = 20'000;  // the scene has about 1,000
  const auto frames = [&](const std::string& patch, int count) {
    std::string list = patch;
    for (int i = 1; i < count; ++i) list += ", " + patch;
    return taken(R"({"scene": )" + long_scene() + R"(, "frames": [)" + list + "]}", limits);
  };
  EXPECT_EQ(frames(R"({"camera": {"fov": 30}})", 500).frames.size(), 500u);
  EXPECT_EQ(frames(R"({"materials": {"red": {"ior": 2}}})", 10).frames.size(), 10u);
  const Taken too_many = frames(R"({"materials": {"red": {"ior": 2}}})", 500);
  ASSERT_EQ(too_many.issues.size(), 1u) << "it ends at the limit";
  EXPECT_TRUE(too_many.issues[0].ends_with(" limit_exceeded")) << too_many.issues[0];
  EXPECT_LT(too_many.frames.size(), 30u);
}

TEST(BatchReader, AppliesPatches) {
  EXPECT_EQ(api::apply_patch(R"({"a": [1, 2], "b": 3})", R"({"b": null, "c": {"d": 4}})"),
            R"({"a":[1,2],"c":{"d":4}})");
  EXPECT_EQ(api::apply_patch(R"({"a": [1, 2]})", R"([{"op": "replace", "path": "/a/1", "value": 5}])"),
            R"({"a":[1,5]})");
  for (const char* patch : {"", "{", R"([{"op": "replace", "path": "/x/1", "value": 5}])", "[7]"}) {
    EXPECT_FALSE(api::apply_patch("{}", patch)) << patch;
  }
  EXPECT_FALSE(api::apply_patch("{", "{}"));
}
