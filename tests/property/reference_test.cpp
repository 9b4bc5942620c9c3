// Whole pictures against the second tracer: equal to the float's last bit, but where a path passes an edge so near that
// rounding decides.
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/support/effort.h"
#include "tests/support/reference_tracer.h"
#include "tests/support/scenes.h"

namespace {

/// Pixels are floats: half a unit in the last place is theirs. The rest is what rounding grows to over eight bounces
/// off curved surfaces.
bool equal(float ours, oracle::Real theirs) { return std::fabs(ours - theirs) <= 0x1p-24L * theirs + 1e-9L; }

struct Difference {
  std::uint64_t edges = 0;  ///< pixels that differ and whose path passes within 1e-9 of an edge
  std::uint64_t wrong = 0;  ///< pixels that differ for no such reason
};

Difference compare(const tracer::Rendered& ours, const std::vector<oracle::Sample>& theirs) {
  Difference difference;
  for (std::size_t i = 0; i < theirs.size(); ++i) {
    const float* rgb = ours.image.rgb.data() + 3 * i;
    const oracle::Light3& expected = theirs[i].radiance;
    if (equal(rgb[0], expected.r) && equal(rgb[1], expected.g) && equal(rgb[2], expected.b)) continue;
    ++(theirs[i].margin < 1e-9L ? difference.edges : difference.wrong);
    if (theirs[i].margin >= 1e-9L && difference.wrong < 4) {
      ADD_FAILURE() << "pixel (" << i % ours.image.width << ", " << i / ours.image.width << ") is " << rgb[0] << " "
                    << rgb[1] << " " << rgb[2] << ", expected " << expected.r << " " << expected.g << " " << expected.b
                    << ", margin " << theirs[i].margin;
    }
  }
  return difference;
}

/// Counts agree exactly where no pixel differs.
void expect_reference(const tracer::Scene& scene, std::uint64_t& edges) {
  tracer::RenderStatistics counted;
  const std::vector<oracle::Sample> theirs = oracle::ReferenceTracer(scene).picture(counted);
  const tracer::Rendered ours = scenes::render(scene);
  const Difference difference = compare(ours, theirs);
  EXPECT_EQ(difference.wrong, 0u);
  edges += difference.edges;
  if (difference.edges > 0) return;
  EXPECT_EQ(ours.statistics.rays.camera, counted.rays.camera);
  EXPECT_EQ(ours.statistics.rays.shadow, counted.rays.shadow);
  EXPECT_EQ(ours.statistics.rays.reflection, counted.rays.reflection);
  EXPECT_EQ(ours.statistics.rays.refraction, counted.rays.refraction);
  EXPECT_EQ(ours.statistics.cut_branches, counted.cut_branches);
  EXPECT_EQ(ours.statistics.truncated_branches, counted.truncated_branches);
  EXPECT_EQ(ours.statistics.non_finite, 0u);
}

TEST(Picture, EqualsTheReferenceInEveryPixelAndRayCountOfRandomScenes) {
  std::uint64_t edges = 0;
  const std::uint64_t count = effort::cases(40);
  for (std::uint64_t seed = 1; seed <= count && !HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    expect_reference(scenes::random(seed, 48), edges);
  }
  RecordProperty("edge_pixels", static_cast<int>(edges));
  EXPECT_LE(edges, count / 10 + 1) << "pixels within 1e-9 of an edge";
}

}  // namespace
