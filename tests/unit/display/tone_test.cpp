// Exposure, overflow, straight color and palettes compared with their formulas.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "tests/support/random.h"
#include "tracer/src/display/tone_mapping.h"

namespace tracer {
namespace {

using Overflow = Output::Overflow;
using Code = std::array<std::uint8_t, 3>;

std::vector<float> toned(std::vector<float> linear, double exposure, Overflow overflow) {
  Output output;
  output.exposure = exposure;
  output.overflow = overflow;
  apply_tone(linear, output);
  return linear;
}

TEST(Tone, DoesNotChangeTheImageByDefault) {
  const std::vector<float> linear{0, 0.1F, 1, 7, 1e30F, std::numeric_limits<float>::max()};
  EXPECT_EQ(toned(linear, 0, Overflow::clamp), linear);
}

TEST(Tone, ExposesByPowersOfTwo) {
  EXPECT_EQ(toned({0.25F, 3}, 2, Overflow::clamp), (std::vector<float>{1, 12}));
  EXPECT_EQ(toned({0.25F, 3}, -1, Overflow::clamp), (std::vector<float>{0.125F, 1.5F}));
  EXPECT_FLOAT_EQ(toned({1}, 0.5, Overflow::clamp)[0], std::sqrt(2.0F));
  EXPECT_EQ(toned({1e30F}, 100, Overflow::clamp)[0], std::numeric_limits<float>::max());
}

TEST(Tone, ScalesByTheBrightestChannelOnlyIfItIsAboveOne) {
  EXPECT_EQ(toned({0.5F, 4, 1}, 0, Overflow::scale), (std::vector<float>{0.125F, 1, 0.25F}));
  EXPECT_EQ(toned({0.5F, 0.25F, 1}, 0, Overflow::scale), (std::vector<float>{0.5F, 0.25F, 1}));
  EXPECT_EQ(toned({0.25F, 0.5F}, 2, Overflow::scale), (std::vector<float>{0.5F, 1})) << "after exposure";
  EXPECT_EQ(toned({0, 0}, 5, Overflow::scale), (std::vector<float>{0, 0}));
}

TEST(Tone, AppliesReinhardsCurveToEachChannel) {
  EXPECT_EQ(toned({0, 1, 3, 0.25F}, 0, Overflow::reinhard), (std::vector<float>{0, 0.5F, 0.75F, 0.2F}));
  EXPECT_EQ(toned({0.5F}, 1, Overflow::reinhard), (std::vector<float>{0.5F}));
  EXPECT_EQ(toned({std::numeric_limits<float>::max()}, 100, Overflow::reinhard), (std::vector<float>{1}));
}

TEST(StraightColor, IsThePremultipliedColorDividedByAlpha) {
  const Image image{3, 1, {0.25F, 0.5F, 1, 0.1F, 0.2F, 0.3F, 0, 0, 0}, {0.5F, 1, 0}};
  EXPECT_EQ(straight_color(image), (std::vector<float>{0.5F, 1, 2, 0.1F, 0.2F, 0.3F, 0, 0, 0}));
}

std::vector<std::uint8_t> random_codes(std::size_t pixels, std::uint32_t colors) {
  oracle::Random random(9);
  std::vector<Code> of(colors);
  for (Code& code : of)
    for (auto& channel : code) channel = static_cast<std::uint8_t>(random.below(256));
  std::vector<std::uint8_t> codes;
  for (std::size_t i = 0; i < pixels; ++i) {
    const Code& code = of[random.below(colors)];
    for (const std::uint8_t channel : code) codes.push_back(channel);
  }
  return codes;
}

Code at(const std::vector<std::uint8_t>& codes, std::size_t i) { return {codes[i], codes[i + 1], codes[i + 2]}; }

TEST(Palette, DoesNotChangeAnImageOfFewColors) {
  const auto codes = random_codes(5000, 40);
  auto reduced = codes;
  reduce_colors(reduced, 40);
  EXPECT_EQ(reduced, codes);
}

TEST(Palette, HasTheRequestedNumberOfColorsEachTheMeanOfItsPixels) {
  const auto codes = random_codes(60000, 30000);
  for (const std::uint32_t colors : {2u, 7u, 16u, 256u}) {
    auto reduced = codes;
    const Palette palette = reduce_colors(reduced, colors);
    ASSERT_EQ(palette.colors.size(), colors);
    std::map<Code, std::array<double, 4>> sums;
    for (std::size_t i = 0; i < codes.size(); i += 3) {
      EXPECT_EQ(palette.colors[palette.indices[i / 3]], at(reduced, i));
      auto& sum = sums[at(reduced, i)];
      for (std::size_t channel = 0; channel < 3; ++channel) sum[channel] += codes[i + channel];
      sum[3] += 1;
    }
    EXPECT_EQ(sums.size(), colors);
    for (const auto& [color, sum] : sums)
      for (std::size_t channel = 0; channel < 3; ++channel)
        EXPECT_EQ(color[channel], std::floor(sum[channel] / sum[3] + 0.5));
  }
}

/// Sum of squared errors after cuts of the box with the longest side, in its middle.
double longest_range_error(const std::vector<std::uint8_t>& codes, std::size_t colors) {
  using Box = std::vector<Code>;
  const auto side = [](const Box& box) {
    std::pair<int, std::size_t> longest{-1, 0};
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const auto less = [&](const Code& a, const Code& b) { return a[channel] < b[channel]; };
      const auto [low, high] = std::minmax_element(box.begin(), box.end(), less);
      longest = std::max(longest, {(*high)[channel] - (*low)[channel], channel});
    }
    return longest;
  };
  std::vector<Box> boxes(1);
  for (std::size_t i = 0; i < codes.size(); i += 3) boxes[0].push_back(at(codes, i));
  while (boxes.size() < colors) {
    Box& box = *std::max_element(boxes.begin(), boxes.end(),
                                 [&](const Box& a, const Box& b) { return side(a).first < side(b).first; });
    const auto [length, channel] = side(box);
    if (length == 0) break;
    int low = 255;
    for (const Code& code : box) low = std::min<int>(low, code[channel]);
    const auto second = std::partition(
        box.begin(), box.end(),
        [&, axis = channel, middle = low + length / 2](const Code& code) { return code[axis] <= middle; });
    Box rest(second, box.end());
    box.erase(second, box.end());
    boxes.push_back(std::move(rest));
  }
  double error = 0;
  for (const Box& box : boxes)
    for (std::size_t channel = 0; channel < 3; ++channel) {
      double sum = 0;
      for (const Code& code : box) sum += code[channel];
      const double mean = std::floor(sum / static_cast<double>(box.size()) + 0.5);
      for (const Code& code : box) error += (code[channel] - mean) * (code[channel] - mean);
    }
  return error;
}

/// A bright gradient with a few small areas of other colors in a dark, large and noisy one.
std::vector<std::uint8_t> lopsided_codes() {
  oracle::Random random(3);
  std::vector<std::uint8_t> codes;
  for (std::uint32_t i = 0; i < 20000; ++i) {
    const bool dark = i % 10 != 0;
    const std::uint32_t red = dark ? 20 + random.below(12) : 100 + i / 130;
    for (const std::uint32_t code : {red, dark ? 20 + random.below(12) : 255 - i / 80, i % 400 == 0 ? 250u : red / 2})
      codes.push_back(static_cast<std::uint8_t>(code));
  }
  return codes;
}

TEST(Palette, HasAnErrorOfAtMostThatOfCutsOfTheLongestRange) {
  for (const auto& codes : {random_codes(20000, 3000), random_codes(20000, 300), lopsided_codes()})
    for (const std::uint32_t colors : {2u, 5u, 16u, 64u, 256u}) {
      auto reduced = codes;
      reduce_colors(reduced, colors);
      double error = 0;
      for (std::size_t i = 0; i < codes.size(); ++i) error += std::pow(codes[i] - reduced[i], 2);
      EXPECT_LE(error, longest_range_error(codes, colors)) << colors;
    }
}

}  // namespace
}  // namespace tracer
