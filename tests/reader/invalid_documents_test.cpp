/// Every document of the tables in tests/reader/invalid has exactly the listed issues and sentences; their bases are
/// accepted.

#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <string>

#include "tests/reader/reading.h"

namespace {

using reader_tests::file_bytes;
using reader_tests::only_detail;
using reader_tests::outcome;

TEST(InvalidDocuments, HaveExactlyTheListedIssues) {
  std::set<std::string> names;
  for (const auto& document : reader_tests::invalid_documents()) {
    EXPECT_EQ(outcome(document.text), document.outcome) << document.name << ": " << document.text;
    if (!document.detail.empty()) {
      EXPECT_EQ(only_detail(document.text), document.detail) << document.name;
    }
    EXPECT_TRUE(document.name.ends_with(".base") || names.insert(document.name).second) << document.name << " twice";
  }
  EXPECT_GE(names.size(), 804u);
}

TEST(ExampleScenes, AreAccepted) {
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(WHITTLE_SOURCE_DIR "/scenes")) {
    if (entry.path().extension() != ".json") continue;
    ++files;
    reader_tests::accepted(file_bytes(entry.path()));
  }
  EXPECT_GT(files, 0u);
}

}  // namespace
