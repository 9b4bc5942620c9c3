/// Millions of samples of random scenes against the intervals of their pixels. WHITTLE_CERTIFY_SEED and
/// WHITTLE_CERTIFY_SCENES select the first seed and the number of scenes.

#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/unit/certify/random_scene.h"

namespace {

std::uint64_t number_of(const char* name, std::uint64_t fallback) {
  const char* const text = std::getenv(name);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : fallback;
}

TEST(PixelBounds, ContainEverySampleOfManyRandomScenes) {
  const std::uint64_t first = number_of("WHITTLE_CERTIFY_SEED", 100'000);
  const std::uint64_t scenes = number_of("WHITTLE_CERTIFY_SCENES", 8'000);
  certify::Comparison all;
  std::uint64_t failures = 0;
  for (std::uint64_t seed = first; seed < first + scenes; ++seed) {
    const certify::RandomScene random = certify::random_scene(seed);
    const certify::Comparison found = certify::compare(random, 16, seed);
    all.samples += found.samples;
    all.pixels += found.pixels;
    all.certified += found.certified;
    all.unbounded += found.unbounded;
    if (found.outside == 0) continue;
    ADD_FAILURE() << "seed " << seed << ": " << found.outside << " samples outside, first " << found.first << "\n"
                  << certify::description(random);
    if (++failures == 10) break;
  }
  std::printf("%llu samples; %.1f %% of the pixels certified, %.1f %% unbounded\n",
              static_cast<unsigned long long>(all.samples),
              100.0 * static_cast<double>(all.certified) / static_cast<double>(all.pixels),
              100.0 * static_cast<double>(all.unbounded) / static_cast<double>(all.pixels));
}

}  // namespace
