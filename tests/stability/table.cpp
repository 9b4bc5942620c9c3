#include "tests/stability/table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <iostream>
#include <set>
#include <sstream>
#include <vector>

namespace stability {
namespace {

struct Line {
  int number;
  std::string text;
};

std::vector<Line>& lines() {
  static std::vector<Line> all;
  return all;
}

struct Samples {
  std::uint64_t tried = 0, wrong = 0;
};

Samples& samples() {
  static Samples all;
  return all;
}

std::string_view text_of(Oracle oracle) {
  switch (oracle) {
    case Oracle::closed_form:
      return "MP";
    case Oracle::invariance:
      return "META";
    case Oracle::conservation:
      break;
  }
  return "PHYS";
}

std::string format_line(std::string_view number, std::string_view name, std::string_view oracle, std::string_view tried,
                        std::string_view unit, std::string_view wrong, std::string_view remark) {
  std::ostringstream text;
  text << std::setw(2) << number << "  " << std::left << std::setw(72) << name << std::setw(6) << oracle << std::right
       << std::setw(11) << tried << " " << std::left << std::setw(10) << unit << std::right << std::setw(6) << wrong
       << "  " << remark;
  return text.str();
}

/// Prints the table after the last test, and reports missing rows.
class Table : public testing::Environment {
 public:
  void TearDown() override {
    if (samples().tried > 0) {
      Row row(0, "no sample that is not finite, no such value in an image", Oracle::conservation, "samples");
      row.count(samples().tried, samples().wrong);
    }
    auto& all = lines();
    std::stable_sort(all.begin(), all.end(), [](const Line& a, const Line& b) {
      return std::pair(a.number == 0, a.number) < std::pair(b.number == 0, b.number);
    });
    std::cout << "\n" << format_line("", "extreme", "oracle", "tried", "", "wrong", "") << "\n";
    std::set<int> seen(std::begin(in_unit_tests), std::end(in_unit_tests));
    for (const Line& line : all) {
      std::cout << line.text << "\n";
      seen.insert(line.number);
    }
    std::cout << std::endl;
    if (testing::GTEST_FLAG(filter) != "*") return;
    for (int number = 0; number <= extremes; ++number)
      EXPECT_TRUE(seen.contains(number)) << "no test made row " << number;
  }
};

[[maybe_unused]] const testing::Environment* const table = testing::AddGlobalTestEnvironment(new Table);

}  // namespace

Row::Row(int number, std::string_view name, Oracle oracle, std::string_view unit)
    : number_(number), name_(name), unit_(unit), oracle_(oracle) {}

void Row::count(std::uint64_t tried, std::uint64_t wrong, std::string_view detail) {
  tried_ += tried;
  if (wrong > 0 && wrong_ < 4 && !detail.empty()) ADD_FAILURE() << detail;
  wrong_ += wrong;
}

void Row::bound(std::string_view reason, double largest_part) {
  reason_ = reason;
  largest_part_ = largest_part;
}

Row::~Row() {
  EXPECT_EQ(wrong_, 0u) << "of " << tried_ << " " << unit_ << ": " << name_;
  EXPECT_GT(tried_, 0u) << name_;
  EXPECT_LE(static_cast<double>(undecided_), largest_part_ * static_cast<double>(tried_)) << "undecided: " << name_;
  std::ostringstream remark;
  remark << note_;
  if (!reason_.empty())
    remark << (note_.empty() ? "" : "; ") << undecided_ << " undecided, at most " << largest_part_
           << " of all: " << reason_;
  lines().push_back({number_, format_line(number_ == 0 ? "-" : std::to_string(number_), name_, text_of(oracle_),
                                          std::to_string(tried_), unit_, std::to_string(wrong_), remark.str())});
}

void compare(Row& row, const tracer::Image& image, const tracer::Image& expected, std::string_view detail) {
  ASSERT_EQ(image.rgb.size(), expected.rgb.size());
  for (auto one = image.rgb.begin(), other = expected.rgb.begin(); one != image.rgb.end(); one += 3, other += 3)
    row.expect(std::equal(one, one + 3, other), detail);
}

void compare_with_reference(Row& row, const tracer::Scene& scene, const Tolerance& tolerance, std::string_view detail) {
  const tracer::Image image = render(scene).image;
  tracer::RenderStatistics ignored;
  const std::vector<oracle::Sample> expected = oracle::ReferenceTracer(scene).image(ignored);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const oracle::Light3& light = expected[i].radiance;
    const oracle::Real channels[] = {light.r, light.g, light.b};
    bool right = true;
    for (std::size_t c = 0; c < 3; ++c)
      right &= std::fabs(image.rgb[3 * i + c] - channels[c]) <= tolerance.absolute + tolerance.relative * channels[c];
    const bool at_edge = expected[i].margin < tolerance.edge;
    if (!right && at_edge) row.undecided();
    row.expect(right || at_edge, detail);
  }
}

tracer::Rendered render(const tracer::Scene& scene, std::uint32_t threads) {
  tracer::Rendered rendered = scenes::render(scene, threads);
  samples().tried += rendered.statistics.samples;
  samples().wrong += rendered.statistics.non_finite;
  for (const float value : rendered.image.rgb) samples().wrong += std::isfinite(value) && value >= 0 ? 0 : 1;
  return rendered;
}

}  // namespace stability
