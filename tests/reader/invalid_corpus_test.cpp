/// Every file of scenes/invalid gives exactly the issues that expected.txt lists for it.

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "tests/reader/reading.h"

namespace {

using reader_tests::file_bytes;
using reader_tests::outcome;

const std::string directory = WHITTLE_SOURCE_DIR "/scenes/invalid/";

std::map<std::string, std::vector<std::string>> expectations() {
  std::map<std::string, std::vector<std::string>> expected;
  std::istringstream lines(file_bytes(directory + "expected.txt"));
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('#')) continue;
    std::istringstream words(line);
    std::string file, first, second;
    words >> file >> first >> second;
    if (first != "too_large") first.append(" ").append(second);
    expected[file].push_back(first);
  }
  return expected;
}

TEST(InvalidScenes, GiveExactlyTheIssuesExpectedInOrder) {
  for (const auto& [file, issues] : expectations()) EXPECT_EQ(outcome(file_bytes(directory + file)), issues) << file;
}

TEST(InvalidScenes, AreAllExpectedAndExpectationsAllHaveAFile) {
  const auto expected = expectations();
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(directory)) {
    const std::string name = entry.path().filename();
    if (!name.ends_with(".json")) continue;
    ++files;
    EXPECT_TRUE(expected.contains(name)) << name << " has no line in expected.txt";
  }
  EXPECT_EQ(files, expected.size());
  EXPECT_GT(files, 400u);
}

TEST(ExampleScenes, AreAllAccepted) {
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(WHITTLE_SOURCE_DIR "/scenes")) {
    if (entry.path().extension() != ".json") continue;
    ++files;
    reader_tests::accepted(file_bytes(entry.path()));
  }
  EXPECT_GT(files, 0u);
}

}  // namespace
