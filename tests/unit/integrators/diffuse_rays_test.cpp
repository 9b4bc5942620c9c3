// Random choices and directions of a packet of diffuse rays against their definitions, lane by lane.
#include "tracer/src/integrators/whitted/diffuse_rays.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "tests/support/chi_square.h"
#include "tracer/src/compile/patch_points.h"
#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

RandomPacket random_packet(std::uint32_t first) {
  RandomPacket random;
  for (std::uint32_t i = 0; i < lanes; ++i) {
    random.key[i] = mix(first + i / 4);
    random.index[i] = first * 3 + i;
    random.path[i] = static_cast<std::uint32_t>(mix(i / 8));
  }
  return random;
}

TEST(RandomChoices, AreThoseOfOneSequenceForEachChoiceAndPath) {
  for (std::uint32_t first = 0; first < 100; ++first) {
    const RandomPacket random = random_packet(first);
    for (const Choice choice : {Choice::direction, Choice::emitter}) {
      PointLanes points;
      double numbers[lanes];
      random_points(random, choice, points);
      random_numbers(random, choice, numbers);
      for (int i = 0; i < lanes; ++i) {
        const std::uint64_t dimension = std::uint64_t{random.path[i]} << 32 | static_cast<std::uint32_t>(choice);
        const Vec2 expected = shuffled_point(random.index[i], mix(random.key[i] ^ mix(dimension)));
        EXPECT_EQ((std::array{points.x[i], points.y[i]}), (std::array{expected.x, expected.y}));
        EXPECT_EQ(numbers[i], expected.x);
      }
    }
  }
}

TEST(DiffuseDirections, HaveTheDensityOfTheCosineAndAreReportedIfAboveTheFace) {
  constexpr int packets = 1 << 12;
  for (int packet = 0; packet < packets; ++packet) {
    ReceiverPacket places{};
    PointLanes points{};
    const Vec3 normal = unit({std::cos(packet), std::sin(packet), std::cos(0.1 * packet)});
    const Vec3 outward = unit(normal + Vec3{0.3, -0.2, 0.5});
    for (int i = 0; i < lanes; ++i) {
      const Vec2 xi = sequence_point(static_cast<std::uint32_t>(packet * lanes + i), mix(1));
      points.x[i] = xi.x;
      points.y[i] = xi.y;
      places.normal.set(i, normal);
      places.outward.set(i, outward);
    }
    VecLanes directions;
    double density[lanes];
    const LaneMask above = aim_diffuse(places, points, directions, density);
    for (int i = 0; i < lanes; ++i) {
      const double cosine = dot(directions[i], normal);
      EXPECT_NEAR(length(directions[i]), 1, 1e-15);
      EXPECT_NEAR(density[i], cosine / std::numbers::pi, 1e-15);
      EXPECT_EQ((above >> i & 1) != 0, dot(directions[i], outward) > 0);
    }
  }
}

TEST(DiffuseDirections, AreDistributedAsTheCosine) {
  const Vec3 normal = normalize({0.3, -0.5, 0.8});
  const auto density = [&](const Vec3& d) { return dot(d, normal) / std::numbers::pi; };
  statistics::expect_distribution([&](const Vec2& xi) { return diffuse_direction(normal, xi); }, density, normal, 0);
  ReceiverPacket places{};
  places.normal.set(0, normal);
  const auto first_lane = [&](const Vec2& xi) {
    VecLanes directions;
    double densities[lanes];
    aim_diffuse(places, {{xi.x}, {xi.y}}, directions, densities);
    return directions[0];
  };
  statistics::expect_distribution(first_lane, density, normal, 0);
}

TEST(ChosenBranches, KeepTheMeanThroughputAndLeaveLanesBeforeTheFirstDiffuseBounce) {
  constexpr int steps = 1000;
  std::array<SecondaryRayPacket, 3> sum{}, rays{};
  constexpr std::array<double, 3> largest{0.1, 0.3, 0.2};
  int ended = 0;
  for (int step = 0; step < steps; ++step) {
    double weight[lanes] = {0, 0.5, 1, 2}, random[lanes] = {};
    for (double& number : random) number = (step + 0.5) / steps;
    for (std::size_t b = 0; b < 3; ++b)
      for (int i = 0; i < 4; ++i) {
        rays[b].throughput.set(i, {largest[b], largest[b] / 2, 0});
        rays[b].largest[i] = largest[b];
        rays[b].going = 0xf;
      }
    SecondaryRayPacket* const all[] = {&rays[0], &rays[1], &rays[2]};
    choose_branch(weight, random, all);
    for (int i = 1; i < 4; ++i) {
      int kept = 0;
      for (std::size_t b = 0; b < 3; ++b) {
        if ((rays[b].going >> i & 1) == 0) continue;
        ++kept;
        EXPECT_NEAR(rays[b].largest[i], std::max(weight[i], 0.6), 1e-15);
        sum[b].throughput.set(i, sum[b].throughput[i] + rays[b].throughput[i]);
      }
      EXPECT_LE(kept, 1);
      ended += kept == 0 ? 1 : 0;
    }
    for (std::size_t b = 0; b < 3; ++b) {
      EXPECT_EQ(rays[b].going & 1, 1u);
      EXPECT_EQ(rays[b].largest[0], largest[b]);
    }
  }
  for (std::size_t b = 0; b < 3; ++b)
    for (int i = 1; i < 4; ++i) {
      EXPECT_NEAR(sum[b].throughput[i].r / steps, largest[b], 2.0 / steps);
      EXPECT_NEAR(sum[b].throughput[i].g / steps, largest[b] / 2, 2.0 / steps);
    }
  EXPECT_NEAR(ended, steps * (0.4 + 0.7), 3) << "at weights of 1 and 2";
}

}  // namespace
}  // namespace tracer
