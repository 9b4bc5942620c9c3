// Axes of plots compared with closed forms, and sanitizing of texts.
#include "tracer/src/plot/scale.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tracer/src/plot/text.h"

namespace tracer::plotting {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

double fifty(const std::string& /*text*/) { return 50; }

using Texts = std::vector<std::string>;

Texts texts(const Ticks& found) {
  Texts all;
  for (const Tick& tick : found.labelled) all.push_back(tick.text());
  return all;
}

TEST(Scale, IsLinearOrLogarithmic) {
  const Scale linear{.low = 2, .high = 6, .from = 100, .to = 300};
  EXPECT_DOUBLE_EQ(linear.place(2), 100);
  EXPECT_DOUBLE_EQ(linear.place(3), 150);
  EXPECT_DOUBLE_EQ(linear.place(6), 300);
  const Scale decades{.low = 0.01, .high = 100, .logarithmic = true, .from = 500, .to = 100};
  for (int power = -2; power <= 2; ++power) EXPECT_NEAR(decades.place(std::pow(10.0, power)), 300 - 100 * power, 1e-10);
}

TEST(Scale, CoversItsValuesWithAMarginOfATwentieth) {
  const Scale linear = covering({50, 60, 70}, false);
  EXPECT_DOUBLE_EQ(linear.low, 49);
  EXPECT_DOUBLE_EQ(linear.high, 71);
  const Scale decades = covering({1, 100, 10}, true);
  EXPECT_NEAR(std::log10(decades.low), -0.1, 1e-14);
  EXPECT_NEAR(std::log10(decades.high), 2.1, 1e-14);
}

TEST(Scale, BeginsAtZeroIfTheLeastPositiveValueIsBelowHalfOfTheGreatest) {
  EXPECT_EQ(covering({4, 10}, false).low, 0);
  EXPECT_GT(covering({6, 10}, false).low, 0);
  EXPECT_LT(covering({-1, 10}, false).low, -1);
}

TEST(Scale, HasAPositiveRangeForOneValueAndForNone) {
  for (const bool logarithmic : {false, true}) {
    for (const double value : {7.0, 1e-300, 1e300, -3.0, 0.0, 1e-310, -1e300}) {
      if (!can_show(value, logarithmic)) continue;
      const Scale scale = covering({value, value}, logarithmic);
      EXPECT_LT(scale.low, value) << value;
      EXPECT_GT(scale.high, value) << value;
      EXPECT_TRUE(std::isfinite(scale.high - scale.low)) << value;
    }
    const Scale scale = covering({}, logarithmic);
    EXPECT_LT(scale.low, scale.high);
    EXPECT_EQ(scale.logarithmic, logarithmic);
  }
}

TEST(Scale, RejectsValuesThatCannotBeDrawn) {
  for (const double value : {std::nan(""), infinity, -infinity, 2e300}) {
    EXPECT_FALSE(can_show(value, false)) << value;
    EXPECT_FALSE(can_show(value, true)) << value;
  }
  for (const double value : {0.0, -1.0, 1e-310}) {
    EXPECT_TRUE(can_show(value, false)) << value;
    EXPECT_FALSE(can_show(value, true)) << value;
  }
}

TEST(Tick, IsWrittenInUsualDecimalNotation) {
  const std::pair<Tick, const char*> cases[] = {{{0, 5}, "0"},
                                                {{1, 0}, "1"},
                                                {{15, 2}, "1500"},
                                                {{20, -3}, "0.02"},
                                                {{125, -2}, "1.25"},
                                                {{-5, -1}, "−0.5"},
                                                {{1, -3}, "0.001"},
                                                {{1, -4}, "10⁻⁴"},
                                                {{1, 4}, "10000"},
                                                {{1, 5}, "10⁵"},
                                                {{25, -8}, "2.5·10⁻⁷"},
                                                {{-3, 12}, "−3·10¹²"},
                                                {{1000, -10}, "10⁻⁷"},
                                                {{12345, 0}, "12345"},
                                                {{123456, -1}, "12345.6"},
                                                {{100, -1}, "10"},
                                                {{123, 290}, "1.23·10²⁹²"}};
  for (const auto& [tick, text] : cases) EXPECT_EQ(tick.text(), text);
}

TEST(Ticks, AreMultiplesOfOneTwoOrFiveTimesAPowerOfTenOrDecades) {
  const std::pair<Scale, Texts> cases[] = {
      {{.low = 0, .high = 1, .from = 0, .to = 300}, {"0", "0.2", "0.4", "0.6", "0.8", "1"}},
      {{.low = -7, .high = 31, .from = 0, .to = 300}, {"0", "10", "20", "30"}},
      {{.low = 0.9, .high = 11, .logarithmic = true, .from = 0, .to = 300}, {"1", "2", "5", "10"}},
      // Too many decades, and too few.
      {{.low = 1e-20, .high = 1e20, .logarithmic = true, .from = 0, .to = 300},
       {"10⁻²⁰", "10⁻¹⁰", "1", "10¹⁰", "10²⁰"}},
      {{.low = 1.15, .high = 1.42, .logarithmic = true, .from = 0, .to = 300},
       {"1.15", "1.2", "1.25", "1.3", "1.35", "1.4"}},
  };
  for (const auto& [scale, expected] : cases) EXPECT_EQ(texts(ticks(scale, fifty)), expected);
}

TEST(Ticks, OfDecadesHaveMinorTicksBetween) {
  const Scale scale{.low = 0.05, .high = 20, .logarithmic = true, .from = 0, .to = 260};  // 100 pixels a decade
  const Ticks found = ticks(scale, fifty);
  EXPECT_EQ(texts(found), (Texts{"0.1", "1", "10"}));
  EXPECT_EQ(found.minor.size(), 5u + 8 + 8 + 1);  // 0.05-0.09, 0.2-0.9, 2-9, 20
}

TEST(Ticks, NeverOverlapAndLieOnTheirAxisForAnyValues) {
  std::mt19937_64 random(1);  // NOLINT: the same axes every time
  std::uniform_real_distribution<double> exponent(-300, 300), unit(-1, 1);
  const auto room = [](const std::string& text) { return text_width(text, 13) + 14; };
  for (int i = 0; i < 2000; ++i) {
    const bool logarithmic = i % 2 == 0;
    const double magnitude = std::pow(10.0, exponent(random));
    const double nearness = std::pow(10.0, unit(random) * 10);
    const double a = logarithmic ? magnitude : magnitude * (1 + unit(random) * nearness);
    const double b = logarithmic ? std::pow(10.0, exponent(random)) : magnitude;
    Scale scale = covering({a, b}, logarithmic);
    scale.from = 900;
    scale.to = 60;
    const Ticks found = ticks(scale, room);
    ASSERT_LE(found.labelled.size() + found.minor.size(), 400u) << a << " " << b;
    double last = infinity, last_room = 0;
    for (const Tick& tick : found.labelled) {
      ASSERT_TRUE(scale.holds(tick.value())) << a << " " << b << " " << tick.text();
      const double place = scale.place(tick.value());
      ASSERT_GE(last - place, (last_room + room(tick.text())) / 2) << a << " " << b << " " << tick.text();
      last = place;
      last_room = room(tick.text());
    }
  }
}

TEST(PlotText, KeepsValidCharactersAndReplacesOthers) {
  EXPECT_EQ(drawable("a <b> é · 10⁻³ 漢 😀"), "a <b> é · 10⁻³ 漢 😀");
  const std::string bad[] = {"\xff", "\xc0\x80", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\x80",        "\xe2\x82",
                             "\x01", "\n",       "\x7f",         "\xc2\x85",         "\xef\xbf\xbe"};
  for (const std::string& text : bad) {
    const std::string safe = drawable("a" + text + "b");
    EXPECT_EQ(safe.substr(0, 4), "a\xef\xbf\xbd");
    EXPECT_EQ(safe.back(), 'b');
    EXPECT_EQ(drawable(safe), safe) << "what came out can be drawn";
  }
}

TEST(PlotText, IsCutBetweenCharactersAndWrappedBetweenWords) {
  const double width = text_width("ééééé", 10);  // of five characters
  EXPECT_EQ(cut("ééééé", 10, width), "ééééé");
  EXPECT_EQ(cut("éééééé", 10, width), "éééé…");
  EXPECT_EQ(cut("anything", 10, 0), "");
  const double ten = text_width("aaaa bbbbb", 10);
  EXPECT_EQ(wrapped("aaaa bbbbb ccc dddd eeeee", 10, ten, 9), (Texts{"aaaa bbbbb", "ccc dddd", "eeeee"}));
  EXPECT_EQ(wrapped("aaaa bbbbb ccc dddd eeeee", 10, ten, 2), (Texts{"aaaa bbbbb", "ccc dddd …"}));
  EXPECT_EQ(wrapped("aaaaabbbbbccccc", 10, ten, 3), (Texts{"aaaaabbb…"}));
  EXPECT_EQ(wrapped("", 10, ten, 3), (Texts{}));
}

}  // namespace
}  // namespace tracer::plotting
