/// Documents that attack the reader: each is read in bounded time and memory. Every case runs in its own process, whose
/// processor time and peak memory are limited far above the need and far below the cost of an attack.

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>
#include <string>

#include "tests/reader/reading.h"

namespace {

using namespace reader_tests;

// What is slow here is ten to thirty times slower under a sanitizer: documents and limits are an eighth there.
#ifdef WHITTLE_SANITIZED
constexpr std::size_t smaller = 8;
constexpr long memory_factor = 6;  // shadow memory and quarantine
constexpr rlim_t seconds_max = 500;
#else
constexpr std::size_t smaller = 1;
constexpr long memory_factor = 1;
constexpr rlim_t seconds_max = 60;
#endif
constexpr std::size_t mebi = (1u << 20) / smaller;

api::Limits hostile_limits() {
  api::Limits limits;
  limits.document.bytes /= smaller;
  limits.document.values /= smaller;
  limits.scene.objects /= smaller;
  return limits;
}

/// Runs `reads_well` in a child process; true if it returned true within `memory_mib` (with the document).
testing::AssertionResult holds(long memory_mib, const std::function<bool()>& reads_well) {
  const pid_t child = fork();
  if (child == 0) {
    const rlimit seconds{seconds_max, seconds_max};
    setrlimit(RLIMIT_CPU, &seconds);
    _exit(reads_well() ? 0 : 1);
  }
  int status = 0;
  rusage usage{};
  if (wait4(child, &status, 0, &usage) != child) return testing::AssertionFailure() << "no child";
  if (WIFSIGNALED(status)) return testing::AssertionFailure() << "ended by signal " << WTERMSIG(status);
  if (WEXITSTATUS(status) != 0) return testing::AssertionFailure() << "another outcome than expected";
  const long peak_mib = usage.ru_maxrss / 1024;
  if (peak_mib > memory_mib * memory_factor) return testing::AssertionFailure() << "took " << peak_mib << " MiB";
  return testing::AssertionSuccess() << peak_mib << " MiB";
}

std::string repeated(std::string_view part, std::size_t bytes) {
  std::string text;
  text.reserve(bytes + part.size());
  while (text.size() < bytes) text += part;
  return text;
}

/// The first outcome of `text` begins with `expected`.
bool gives(const std::string& text, std::string_view expected, const api::Limits& limits = hostile_limits()) {
  return outcome(text, limits).at(0).starts_with(expected);
}

TEST(ReaderLimits, StopAtDepth) {
  EXPECT_TRUE(holds(200, [] { return gives(std::string(64 * mebi, '['), "too_large"); }));
  EXPECT_TRUE(holds(250, [] { return gives(repeated("{\"a\":", 64 * mebi - 8), "too_large"); }));
}

TEST(ReaderLimits, AllowDeepNestingWithoutRecursion) {
  api::Limits limits = hostile_limits();
  limits.document.depth = limits.document.values;
  EXPECT_TRUE(holds(700, [&] { return gives(std::string(16 * mebi, '['), "not_json", limits); }));
}

TEST(ReaderLimits, RejectTooManyBytesBeforeParsing) {
  EXPECT_TRUE(holds(200, [] { return gives(std::string(64 * mebi + 1, '['), "too_large"); }));
}

TEST(ReaderLimits, StopAtValues) {
  EXPECT_TRUE(holds(700, [] { return gives("[" + repeated("1,", 63 * mebi) + "1]", "too_large"); }));
  EXPECT_TRUE(holds(900, [] { return gives("[" + repeated("[],", 63 * mebi) + "1]", "too_large"); }));
  EXPECT_TRUE(holds(900, [] { return gives("[" + repeated("\"\\n\",", 63 * mebi) + "1]", "\"\" wrong_type"); }));
}

TEST(ReaderLimits, RefuseLongStringsKeysAndNumbersUnread) {  // a parser that reads them takes 200 MiB more
  EXPECT_TRUE(holds(220, [] { return gives('"' + std::string(63 * mebi, 'x') + '"', "too_large"); }));
  EXPECT_TRUE(holds(220, [] { return gives("{\"" + std::string(63 * mebi, 'x') + "\":1}", "too_large"); }));
  EXPECT_TRUE(holds(220, [] { return gives(std::string(63 * mebi, '1'), "too_large"); }));
  EXPECT_TRUE(holds(220, [] { return gives("1e" + std::string(63 * mebi, '9'), "too_large"); }));
  EXPECT_TRUE(holds(220, [] { return gives('"' + repeated("\\u0041", 63 * mebi) + '"', "too_large"); }));
}

TEST(ReaderLimits, ReportTheFirstOfMillionsOfIssues) {
  const auto has_1001_issues = [](const std::string& text) { return outcome(text, hostile_limits()).size() == 1001; };
  EXPECT_TRUE(
      holds(900, [&] { return has_1001_issues(document_with(repeated("\"nmae\":1,", 24 * mebi) + "\"x\":1")); }));
  EXPECT_TRUE(holds(900, [&] {
    return has_1001_issues(document_with("\"name\":\"\"," + repeated("\"name\":1,", 24 * mebi) + "\"x\":1"));
  }));
  EXPECT_TRUE(holds(1000, [&] {
    return has_1001_issues(
        document_with_object("mesh", "\"positions\":[" + repeated("[],", 16 * mebi) + "7],\"triangles\":[]"));
  }));
  EXPECT_TRUE(holds(1000, [&] {
    return has_1001_issues(document_with_object(
        "mesh", "\"positions\":[[0,0,0]],\"triangles\":[" + repeated("[9,9,9],", 16 * mebi) + "[0,0,0]]"));
  }));
  EXPECT_TRUE(holds(
      1300, [&] { return has_1001_issues(document_with("\"objects\":[" + repeated("{},", 10 * mebi) + "{}]")); }));
}

TEST(ReaderLimits, SkipObjectsAndMaterialsAboveTheirLimit) {
  const auto with_objects = [](std::string_view object) {
    return document_with("\"objects\":[" + repeated(object, 40 * mebi) + "1]");
  };
  EXPECT_TRUE(holds(400, [&] { return gives(with_objects("{},"), "/objects limit_exceeded"); }));
  EXPECT_TRUE(holds(
      1300, [&] { return outcome(with_objects(R"({"material":{"color":{}}},)"), hostile_limits()).size() == 1001; }));
}

TEST(ReaderLimits, SkipMapsAboveTheirLimit) {
  const auto named = [](const char* section, std::size_t count, const char* value) {
    std::string text = std::string("\"") + section + "\":{";
    for (std::size_t i = 0; i < count; ++i) text += '"' + std::to_string(i) + "\":" + value + ',';
    return document_with(text + "\"last\":" + value + "}");
  };
  EXPECT_TRUE(
      holds(600, [&] { return gives(named("materials", 2'000'000 / smaller, "{}"), "/materials limit_exceeded"); }));
  EXPECT_TRUE(holds(1500, [&] {
    return gives(named("textures", 1'000'000 / smaller, "{\"checker\":[0,1]}"), "/textures limit_exceeded");
  }));
}

TEST(ReaderLimits, BoundTheTimeOfSuggestions) {
  std::string materials, objects;
  for (int i = 0; i < 90'000 / static_cast<int>(smaller); ++i) {
    materials += "\"material number " + std::to_string(i) + "\":{},";
    objects +=
        R"({"type":"plane","point":[0,0,0],"normal":[0,1,0],"material":"material numbre )" + std::to_string(i) + "\"},";
  }
  const std::string text = document_with("\"materials\":{" + materials + "\"z\":{}},\"objects\":[" + objects + "1]");
  EXPECT_TRUE(holds(500, [&] { return outcome(text, hostile_limits()).size() == 1001; }));
}

TEST(ReaderLimits, BoundTheTimeOfTriangulation) {
  std::string positions, face, faces;
  const int corners = 256;
  for (int i = 0; i < corners; ++i) {  // a comb: every second corner is reflex
    positions += "[" + std::to_string(i) + "," + std::to_string(i % 2 == 0 ? 0 : 100 + i) + ",0],";
    face += std::to_string(i) + (i + 1 < corners ? "," : "");
  }
  positions += "[" + std::to_string(corners) + ",-5,0]";
  for (int i = 0; i < 2000 / static_cast<int>(smaller); ++i) faces += (i ? ",[" : "[") + face + "]";
  const std::string text = document_with_object("mesh", "\"positions\":[" + positions + "],\"faces\":[" + faces + "]");
  EXPECT_TRUE(holds(500, [&] { return gives(text, "accepted"); }));
}

TEST(ReaderLimits, AcceptLargeValidDocuments) {
  std::string text = "\"positions\":[";
  for (int i = 0; i < 1'500'000 / static_cast<int>(smaller); ++i) text += "[" + std::to_string(i) + ",2,3],";
  text += "[0,0,0]],\"triangles\":[" + repeated("[0,1,2],", 20 * mebi) + "[0,1,2]]";
  EXPECT_TRUE(holds(1000, [&] { return gives(document_with_object("mesh", text), "accepted"); }));
}

}  // namespace
