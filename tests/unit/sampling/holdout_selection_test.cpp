// An audit's choice of pixels: what it stands for is the image, whatever was expected of it.
#include "tracer/src/sampling/holdout_selection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace tracer {
namespace {

/// `count` pixels, every `step`th refined to 2^(2..6) samples with a variance that differs by a thousand.
std::vector<PixelState> some_refined(std::size_t count, std::size_t step) {
  std::vector<PixelState> pixels(count);
  for (std::size_t i = 0; i < count; i += step) {
    pixels[i].role = PixelState::Role::refined;
    pixels[i].half_count.fill(2u << (i / step % 5));
    pixels[i].variance = std::exp2(static_cast<float>(i / step % 11));
  }
  return pixels;
}

/// The mean over many streams of what the choices make of `errors`, and its standard error.
struct Told {
  double mean = 0, deviation = 0;
};
template <class Choose>
Told told(const std::vector<double>& errors, const Choose& choose) {
  constexpr std::uint64_t streams = 2000;
  double sum = 0, squares = 0;
  for (std::uint64_t stream = 0; stream < streams; ++stream) {
    double one = 0;
    for (const HoldoutPixel& choice : choose(stream)) one += errors[choice.place] * choice.stands_for;
    sum += one;
    squares += one * one;
  }
  const double mean = sum / streams;
  return {mean, std::sqrt(std::max(0.0, squares / streams - mean * mean) / streams)};
}

/// Errors that have little to do with what is expected.
std::vector<double> errors_of(std::size_t count) {
  std::vector<double> errors(count);
  for (std::size_t i = 0; i < count; ++i) errors[i] = std::pow(static_cast<double>(i * 7919 % 101), 2);
  return errors;
}

TEST(AnAuditsChoices, TellTheSumOfErrorsWithoutBiasWhateverWasExpected) {
  const auto pixels = some_refined(3000, 3);
  const std::vector<double> errors = errors_of(pixels.size());
  const double truth = std::accumulate(errors.begin(), errors.end(), 0.0);
  for (const AuditSize size : {AuditSize{200, 100}, AuditSize{3000, 256}, AuditSize{20, 5}}) {
    const Told sum = told(errors, [&](std::uint64_t stream) { return choose_audits(pixels, size, stream, 7); });
    EXPECT_NEAR(sum.mean, truth, 4.5 * sum.deviation) << size.looks << " looks, " << size.draws << " draws";
    EXPECT_LT(sum.deviation, 0.05 * truth);
  }
}

TEST(AnAuditsChoices, OfPixelsThatNothingIsKnownOfTellTheSumWithoutBias) {
  for (const std::size_t pixels : {1u, 7u, 1000u}) {
    const std::vector<double> errors = errors_of(pixels);
    const double truth = std::accumulate(errors.begin(), errors.end(), 0.0);
    const Told sum = told(errors, [&](std::uint64_t stream) { return choose_audits(pixels, 64, stream, 3); });
    EXPECT_NEAR(sum.mean, truth, 4.5 * sum.deviation + 1e-12 * truth) << pixels;
  }
}

TEST(AnAuditsChoices, OfErrorsAsTheyWereExpectedTellTheSumBetterThanAsManyLooks) {
  const auto pixels = some_refined(20'000, 100);
  std::vector<double> errors(pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) errors[i] = pixels[i].refined() ? pixels[i].variance : 0;
  const auto spread = [&](const AuditSize& size) {
    return told(errors, [&](std::uint64_t stream) { return choose_audits(pixels, size, stream, 0); }).deviation;
  };
  EXPECT_LT(3 * spread({512, 256}), spread({2048, 0}));
}

TEST(AnAuditsChoices, LookAtEveryCheapPixelOfASmallImage) {
  const auto pixels = some_refined(2000, 5);
  const auto choices = choose_audits(pixels, thorough_audit(pixels.size()), 1, 0);
  std::vector<bool> looked(pixels.size());
  for (const HoldoutPixel& choice : choices) looked[choice.place] = true;
  for (std::size_t i = 0; i < pixels.size(); ++i) EXPECT_TRUE(looked[i] || pixels[i].count() > 8) << i;
}

TEST(AnAuditsChoices, AreAscendingAndOfOtherPixelsInEveryStream) {
  const auto pixels = some_refined(5000, 4);
  const auto one = choose_audits(pixels, {100, 50}, 1, 0), other = choose_audits(pixels, {100, 50}, 2, 0);
  const auto place = [](const HoldoutPixel& choice) { return choice.place; };
  EXPECT_TRUE(std::ranges::is_sorted(one, std::ranges::less_equal{}, place));
  EXPECT_FALSE(std::ranges::equal(one, other, {}, place, place));
}

TEST(AnAuditWithin, CostsNoMoreThanItMayButLooksAtALittle) {
  const auto pixels = some_refined(50'000, 3);
  const auto cost = [&](const AuditSize& size) {
    double samples = 0;
    for (const HoldoutPixel& choice : choose_audits(pixels, size, 1, 0)) samples += 2 * choice.half;
    return samples;
  };
  const double thorough = cost(thorough_audit(pixels.size()));
  for (const double part : {0.1, 0.3, 0.8})
    EXPECT_NEAR(cost(audit_within(pixels, part * thorough)), part * thorough, 0.15 * part * thorough) << part;
  EXPECT_EQ(audit_within(pixels, 1e9).draws, thorough_audit(pixels.size()).draws);
  EXPECT_GT(audit_within(pixels, 0).looks, 0);
}

}  // namespace
}  // namespace tracer
