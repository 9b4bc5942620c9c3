#pragma once
/// Hits of the accelerator against expected hits on each primitive in long double.

#include <cmath>
#include <optional>

#include "tests/unit/accel/ray_batch.h"

namespace tracer {

/// Expected hit on one primitive, with bounds of its errors in double; coordinates without a bound are not compared.
struct ExpectedHit {
  std::optional<bool> hit{};  ///< nothing where rounding decides
  oracle::Real t = HUGE_VALL, t_error = 0;
  oracle::Real u = 0, u_error = HUGE_VALL;
  oracle::Real v = 0, v_error = HUGE_VALL;
};

struct Target {
  PrimitiveRef primitive;
  bool transmissive = false;
};

/// The nearest of expected hits.
struct ExpectedNearest {
  ExpectedHit hit{};
  PrimitiveRef primitive{};
  bool certain = true;

  void add(const ExpectedHit& other, const PrimitiveRef& of) {
    const bool hits = other.hit.value_or(false);
    certain &= other.hit.has_value() && !(hits && std::fabs(other.t - hit.t) <= other.t_error + hit.t_error);
    if (!hits || other.t >= hit.t) return;
    hit = other;
    primitive = of;
  }
};

inline void expect_hit(const TestHit& found, const ExpectedNearest& expected) {
  ASSERT_EQ(found.primitive, expected.primitive);
  if (!expected.primitive.hit()) return;
  const ExpectedHit& hit = expected.hit;
  ASSERT_LE(std::fabs(found.t - hit.t), hit.t_error);
  EXPECT_TRUE(!std::isfinite(hit.u_error) || std::fabs(found.u - hit.u) <= hit.u_error) << found.u << ", not " << hit.u;
  EXPECT_TRUE(!std::isfinite(hit.v_error) || std::fabs(found.v - hit.v) <= hit.v_error) << found.v << ", not " << hit.v;
}

/// Rays, those whose result is certain, and those of them that hit.
struct HitCounts {
  std::uint64_t tried = 0, certain = 0, hits = 0;
};

/// Expects that rays with a certain result hit the nearest target, or with a mask the nearest transmissive one, and are
/// occluded by opaque ones. `expected_for(i, ray)`: the ExpectedHit on target i.
template <class ExpectedFor>
void expect_nearest(const GeometrySet& set, const std::vector<Target>& targets, const std::vector<TestRay>& rays,
                    const ExpectedFor& expected_for, HitCounts& counts) {
  const auto accelerator = built(set);
  const RayBatch batch(rays);
  std::vector<TestHit> found[2], through[2];
  std::vector<bool> blocked[2];
  for (const int i : {0, 1}) {
    const Coherence coherence = i == 0 ? Coherence::coherent : Coherence::incoherent;
    found[i] = batch.intersect(*accelerator, coherence);
    through[i] = batch.intersect(*accelerator, coherence, GeometryMask::transmissive);
    blocked[i] = batch.occluded(*accelerator, coherence);
  }
  for (std::size_t ray = 0; ray < rays.size(); ++ray) {
    ExpectedNearest nearest, nearest_through;
    bool opaque = false;
    for (std::size_t i = 0; i < targets.size(); ++i) {
      const ExpectedHit expected = expected_for(i, rays[ray]);
      nearest.add(expected, targets[i].primitive);
      if (targets[i].transmissive) nearest_through.add(expected, targets[i].primitive);
      opaque |= !targets[i].transmissive && expected.hit.value_or(false);
    }
    ++counts.tried;
    if (!nearest.certain || !nearest_through.certain) continue;
    ++counts.certain;
    counts.hits += nearest.primitive.hit() ? 1 : 0;
    for (const int i : {0, 1}) {
      expect_hit(found[i][ray], nearest);
      expect_hit(through[i][ray], nearest_through);
      EXPECT_EQ(blocked[i][ray], opaque);
      if (testing::Test::HasFailure()) FAIL() << "ray " << ray << " at " << nearest.hit.t << ", coherence " << i;
    }
  }
}

}  // namespace tracer
