// Ray origins are on the correct side of the surface at every scale.
#include "tracer/src/math/rounding.h"

#include <gtest/gtest.h>

#include "tests/support/effort.h"
#include "tests/support/random.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;

TEST(OffsetOrigin, IsOutsideOfTheErrorBoxOnTheSideOfTheDirection) {
  Random random(1);
  for (std::uint64_t i = 0; i < effort::cases(300'000); ++i) {
    const double scale = random.spread(1e-100, 1e100);
    BoundedPoint point{random.vector(scale), {}};
    const Vec3 axes[] = {{1, 0, 0}, {0, -1, 0}, {0, 0, 1}};
    const Vec3 normal = random.chance(0.2) ? axes[random.below(3)] : rounded(random.direction());
    // From the last bit of a coordinate to a thousandth of it.
    point.error = abs(point.position) * random.spread(2e-16, 1e-3);
    Vec3 direction = rounded(random.direction());
    if (random.chance(0.3)) direction = rounded(random.across(normal));  // along the surface
    const Vec3 origin = offset_origin(point, normal, direction);
    const Real side = dot(direction, normal) < 0 ? -1 : 1;
    const Vec moved = Vec(origin) - Vec(point.position);
    const Vec n = normal;
    const Real height = side * dot(moved, n);
    const Real box = std::fabs(n.x) * point.error.x + std::fabs(n.y) * point.error.y + std::fabs(n.z) * point.error.z;
    ASSERT_GE(height, box);
    // The offset is not much larger, which would skip thin shapes.
    const Vec3 size = abs(point.position) + abs(normal) * static_cast<double>(box);
    ASSERT_LE(length(moved), 1.01L * box + 4 * 0x1p-53L * length(Vec(size)));
  }
}

}  // namespace
}  // namespace tracer
