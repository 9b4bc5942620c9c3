// The solver of the radiosity system: its solution satisfies every row, and its bound holds after every sweep.
#include "tracer/src/radiosity/transport.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/random.h"

namespace {

using namespace tracer;

/// Random sources and rows; the shares of a row sum to `reflectance` in red, and to less in green and blue.
Transport random_transport(std::uint32_t patches, double reflectance) {
  oracle::Random random(patches);
  Transport transport;
  for (std::uint32_t i = 0; i < patches; ++i) {
    std::vector<double> shares(patches);
    double sum = 0;
    for (double& share : shares) sum += share = random.chance(0.5) ? random.in(0, 1) : 0;
    std::vector<TransportEntry> row;
    for (std::uint32_t j = 0; j < patches; ++j)
      if (shares[j] > 0)
        row.emplace_back(j, Color{1, random.in(0, 1), random.in(0, 1)} * (reflectance * shares[j] / sum));
    transport.add_row(random.color(), row);
  }
  return transport;
}

TransportSolution solved(const Transport& transport, std::uint32_t sweeps_max = 10'000) {
  RenderControl control;
  return solve(transport, 1e-14, sweeps_max, control);
}

double largest_difference(const Color& a, const Color& b) {
  return std::max({std::abs(a.r - b.r), std::abs(a.g - b.g), std::abs(a.b - b.b)});
}

TEST(TransportSolution, SatisfiesEveryRow) {
  for (const std::uint32_t patches : {1u, 2u, 50u, 300u})
    for (const double reflectance : {0.5, 0.9, 0.99}) {
      const Transport transport = random_transport(patches, reflectance);
      const TransportSolution solution = solved(transport);
      ASSERT_EQ(solution.values.size(), patches);
      for (std::size_t i = 0; i < patches; ++i) {
        Color row = transport.source(i);
        for (const TransportEntry& entry : transport.row(i)) row += solution.values[entry.patch] * entry.share();
        ASSERT_LE(largest_difference(solution.values[i], row), 1e-13) << i << " of " << patches << ", " << reflectance;
      }
    }
}

TEST(TransportSolution, IsWithinItsBoundAfterEverySweep) {
  const Transport transport = random_transport(24, 0.9);
  const TransportSolution exact = solved(transport);
  double before = std::numeric_limits<double>::infinity();
  for (std::uint32_t sweeps = 1; sweeps <= 40; ++sweeps) {
    const TransportSolution early = solved(transport, sweeps);
    double difference = 0;
    for (std::size_t i = 0; i < exact.values.size(); ++i)
      difference = std::max(difference, largest_difference(early.values[i], exact.values[i]));
    ASSERT_LE(difference, early.bound) << sweeps;
    ASSERT_LT(early.bound, before) << sweeps;
    before = early.bound;
  }
}

TEST(TransportSolution, OfPatchesThatAbsorbNothingEndsWithoutABound) {
  Transport transport;
  transport.add_row({1, 1, 1}, std::vector<TransportEntry>{{1, Color{1, 1, 1}}});
  transport.add_row({0, 0, 0}, std::vector<TransportEntry>{{0, Color{1, 1, 1}}});
  const TransportSolution solution = solved(transport, 50);
  EXPECT_EQ(solution.sweeps, 50u);
  EXPECT_EQ(solution.bound, std::numeric_limits<double>::infinity());
}

TEST(TransportSolution, IsLeftEarlyWhenCancelled) {
  RenderControl control;
  control.cancel();
  EXPECT_EQ(solve(random_transport(6, 0.5), 0, 10'000, control).sweeps, 0u);
}

TEST(TransportEntries, OfEqualPatchesAreAddedUp) {
  std::vector<TransportEntry> entries = {{2, Color{1, 0, 0}}, {0, Color{4, 4, 4}}, {2, Color{0, 2, 0}}};
  merge_entries(entries);
  ASSERT_EQ(entries.size(), 2u);
  EXPECT_EQ(entries[0].patch, 0u);
  EXPECT_EQ(entries[1].patch, 2u);
  EXPECT_EQ(entries[1].share(), (Color{1, 2, 0}));
}

}  // namespace
