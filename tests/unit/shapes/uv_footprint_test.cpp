// Texture footprints of beams, in packets and single, against long double.
#include <gtest/gtest.h>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tracer/src/interaction/surface.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Vec;

struct Beam {
  UvGradients gradients;
  Vec3 normal, direction;
  double width = 0;
};

Beam random_beam(Random& random) {
  const Vec3 normal = rounded(random.direction());
  const Vec3 direction = random.chance(0.2) ? normal * random.sign() : rounded(random.direction());
  return {{random.vector(10), random.vector(0.1)}, normal, direction, random.spread(1e-6, 1)};
}

/// Expected footprint, in axes along and across the tilt.
Vec2 expected_footprint(const Beam& beam) {
  const Vec n = beam.normal, d = beam.direction;
  const Vec down = d - dot(d, n) * n;
  const Vec along = length(down) > 1e-8L
                        ? unit(down)
                        : unit(cross(n, std::abs(beam.normal.x) < 0.5 ? Vec(Vec3{1, 0, 0}) : Vec(Vec3{0, 1, 0})));
  const Vec across = cross(n, along);
  const auto width = [&](const Vec& gradient) {
    return static_cast<double>(
        std::hypot(dot(gradient, along) * beam.width / std::fabs(dot(d, n)), dot(gradient, across) * beam.width));
  };
  return {width(beam.gradients.u), width(beam.gradients.v)};
}

TEST(UvFootprint, StretchesTheSquareOfTheBeamAlongTheTilt) {
  Random random(21);
  for (std::uint64_t i = 0; i < effort::cases(20'000); ++i) {
    const Beam beam = random_beam(random);
    if (std::abs(dot(beam.normal, beam.direction)) < 1e-3) continue;
    const Vec2 found = uv_footprint(beam.gradients, beam.normal, beam.direction, beam.width),
               expected = expected_footprint(beam);
    ASSERT_NEAR(found.x, expected.x, 1e-9 * (expected.x + beam.width)) << i;
    ASSERT_NEAR(found.y, expected.y, 1e-9 * (expected.y + beam.width)) << i;
  }
}

TEST(UvFootprint, IsBitIdenticalInPackets) {
  Random random(22);
  for (std::uint64_t round = 0; round < effort::cases(1'000); ++round) {
    Beam beams[lanes];
    FacePacket faces{};
    FootprintPacket packet{};
    for (int i = 0; i < lanes; ++i) {
      const Beam& beam = beams[i] = random_beam(random);
      faces.face.set(i, beam.normal);
      packet.gradient_u.set(i, beam.gradients.u);
      packet.gradient_v.set(i, beam.gradients.v);
      packet.direction.set(i, beam.direction);
      packet.width[i] = beam.width;
    }
    compute_footprints(faces, packet);
    for (int i = 0; i < lanes; ++i) {
      const Vec2 single = uv_footprint(beams[i].gradients, beams[i].normal, beams[i].direction, beams[i].width);
      ASSERT_EQ(packet.u[i], single.x);
      ASSERT_EQ(packet.v[i], single.y);
    }
  }
}

}  // namespace
}  // namespace tracer
