/// Names of files, and the step that loads the files.

#include <gtest/gtest.h>

#include "api/load_assets.h"
#include "tests/reader/reading.h"

namespace {

using namespace reader_tests;
using Issues = std::vector<std::string>;

std::string textures_of(const Issues& names) {
  std::string members;
  for (std::size_t i = 0; i < names.size(); ++i)
    members += (i == 0 ? "\"" : ", \"") + std::to_string(i) + R"(": {"file": ")" + names[i] + "\"}";
  return document_with("\"textures\": {" + members + "}");
}

Issues verdict(const std::string& name, api::Files files) {
  api::Limits limits;
  limits.files = files;
  return outcome(textures_of({name}), limits);
}

TEST(AssetNames, AcceptOnlyPlainPathsBelowADirectory) {
  for (const char* name : {"a", "a.png", "a/b c/d", "...", "..a/b..", ".hidden", "caf\xc3\xa9.png", "a:b"})
    EXPECT_EQ(verdict(name, api::Files::below_a_directory), Issues{"accepted"}) << name;
  for (const char* name : {"..", ".", "/", "/a", "a/", "a//b", "../a", "a/..", "a/../b", "./a", "a/./b", "a/.",
                           R"(a\\b)", R"(..\\a)", R"(\u002e\u002e/a)", R"(a\u0000)", ""})
    EXPECT_EQ(verdict(name, api::Files::below_a_directory), Issues{"/textures/0/file malformed"}) << name;
}

TEST(AssetNames, AcceptAnyPathOnTheCommandLine) {
  for (const char* name : {"..", "/a", "../a", "a//b", R"(a\\b)"})
    EXPECT_EQ(verdict(name, api::Files::anywhere), Issues{"accepted"}) << name;
}

TEST(AssetNames, RejectLongNames) {
  for (const api::Files files : {api::Files::anywhere, api::Files::below_a_directory}) {
    EXPECT_EQ(verdict(std::string(4096, 'a'), files), Issues{"accepted"});
    EXPECT_EQ(verdict(std::string(4097, 'a'), files), Issues{"/textures/0/file limit_exceeded"});
  }
}

TEST(AssetNames, AcceptHashesOfUploads) {
  const std::string hash = "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef";
  for (const api::Files files : {api::Files::none, api::Files::anywhere, api::Files::below_a_directory}) {
    api::Limits limits;
    limits.files = files;
    EXPECT_EQ(outcome(textures_of({"sha256:" + hash}), limits), Issues{"/textures/0/file unsupported"});
    limits.uploads = true;
    EXPECT_EQ(outcome(textures_of({"sha256:" + hash}), limits), Issues{"accepted"});
    for (const std::string& name : {std::string(), std::string("00"), hash.substr(1), hash + "0", hash.substr(1) + "A",
                                    hash.substr(1) + "g", hash.substr(1) + "/", hash.substr(3) + "/.."})
      EXPECT_EQ(outcome(textures_of({"sha256:" + name}), limits), Issues{"/textures/0/file malformed"}) << name;
  }
}

TEST(AssetNames, RejectFilesIfOnlyUploadsAreAllowed) {
  api::Limits limits;
  limits.uploads = true;
  EXPECT_EQ(outcome(textures_of({"a.png"}), limits), Issues{"/textures/0/file unsupported"});
}

TEST(LoadAssets, ReadsEachFileOnceInOrder) {
  tracer::Scene scene = accepted(textures_of({"b", "a", "b", "c"})).scene;
  Issues names_read;
  const auto assets = api::load_assets(scene,
                                       [&](const std::string& name) -> api::AssetBytes {
                                         names_read.push_back(name);
                                         return std::vector<std::uint8_t>(name.begin(), name.end());
                                       },
                                       {});
  ASSERT_TRUE(assets);
  EXPECT_EQ(names_read, (Issues{"b", "a", "c"}));
  EXPECT_EQ(assets->bytes, (std::vector<std::vector<std::uint8_t>>{{'b'}, {'a'}, {'c'}}));
}

TEST(LoadAssets, ReportsUnavailableFilesAtTheirFirstUse) {
  tracer::Scene scene = accepted(textures_of({"b", "a", "b", "c"})).scene;
  const auto assets = api::load_assets(scene,
                                       [](const std::string& name) -> api::AssetBytes {
                                         if (name == "a") return std::vector<std::uint8_t>();
                                         return std::string("is gone");
                                       },
                                       {});
  ASSERT_FALSE(assets);
  EXPECT_EQ(assets.error(), (std::vector<tracer::Issue>{{"/textures/0/file", "bad_asset", "b: is gone"},
                                                        {"/textures/3/file", "bad_asset", "c: is gone"}}));
}

TEST(CheckAssets, ReportsAThousandFilesAndCountsTheOthers) {
  Issues names;
  for (int i = 0; i < 1003; ++i) names.push_back("f" + std::to_string(i));
  const tracer::Scene scene = accepted(textures_of(names)).scene;
  const auto issues =
      api::check_assets(scene, [](const std::string& name) { return name == "f0" ? "" : "no such file"; });
  ASSERT_EQ(issues.size(), 1001u);
  EXPECT_EQ(issues[999].detail, "f1000: no such file");
  EXPECT_EQ(issues[1000].code + ": " + issues[1000].detail, "too_many_issues: and 2 more");
}

}  // namespace
