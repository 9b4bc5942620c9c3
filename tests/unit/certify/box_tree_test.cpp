#include "tracer/src/certify/box_tree.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/support/random.h"
#include "tests/unit/accel/ray_batch.h"

namespace {

using namespace tracer;

GeometrySet spheres(oracle::Random& random, std::size_t count) {
  GeometrySet geometry;
  SphereGeometry& set = geometry.spheres.emplace_back();
  for (std::size_t i = 0; i < count; ++i) add_sphere(set, random.vector(0.5), random.spread(1e-4, 0.1));
  return geometry;
}

/// Primitives whose boxes the region reaches.
std::set<std::uint32_t> found(const BoxTree& tree, const ConvexRegion& region) {
  std::set<std::uint32_t> primitives;
  tree.each(region, [&](const PrimitiveRef& primitive) { return primitives.insert(primitive.primitive).second; });
  return primitives;
}

TEST(BoxTree, HasEveryPrimitiveOnce) {
  oracle::Random random(3);
  const RenderControl control;
  for (const std::size_t count : {0u, 1u, 8u, 9u, 64u, 65u, 500u, 4097u}) {
    const GeometrySet geometry = spheres(random, count);
    EXPECT_EQ(found(BoxTree(geometry, control), ConvexRegion()).size(), count);
  }
}

TEST(BoxTree, EndsWhenTheCallerHasEnough) {
  oracle::Random random(5);
  const BoxTree tree(spheres(random, 500), RenderControl());
  int seen = 0;
  tree.each(ConvexRegion(), [&](const PrimitiveRef&) { return ++seen < 7; });
  EXPECT_EQ(seen, 7);
}

/// Points on segments between two boxes are in the shaft: a sphere around one is never rejected.
TEST(BoxTree, FindsWhateverASegmentOfAShaftTouches) {
  oracle::Random random(4);
  const RenderControl control;
  std::size_t expected = 0, all = 0;
  for (int round = 0; round < 60; ++round) {
    const GeometrySet geometry = spheres(random, 400);
    const SphereGeometry& set = geometry.spheres[0];
    const BoxTree tree(geometry, control);
    Bounds from, to;
    for (Bounds* box : {&from, &to}) {
      const double size = random.spread(1e-4, 0.2);
      box->include(random.vector(0.5), {size, random.chance(0.2) ? 0 : size, size});
    }
    const std::set<std::uint32_t> candidates = found(tree, shaft(from, to));
    all += candidates.size();
    const auto inside = [&](const Bounds& box) {
      return Vec3{random.in(box.low.x, box.high.x), random.in(box.low.y, box.high.y), random.in(box.low.z, box.high.z)};
    };
    for (int ray = 0; ray < 200; ++ray) {
      const Vec3 a = inside(from), b = inside(to);
      for (std::uint32_t i = 0; i < set.x.size(); ++i) {
        const Vec3 center{set.x[i], set.y[i], set.z[i]};
        const double t = std::clamp(dot(center - a, b - a) / dot(b - a, b - a), 0.0, 1.0);
        if (!(length(a + (b - a) * t - center) < set.radius[i])) continue;
        EXPECT_TRUE(candidates.contains(i));
        ++expected;
      }
    }
  }
  EXPECT_GT(expected, 5'000u);
  EXPECT_LT(all, 60u * 400 / 2);  // the shafts reject most spheres
}

}  // namespace
