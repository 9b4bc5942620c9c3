// Cylinders and cones where their equations degenerate: along the axis, at the apex, on the mirror nappe, at rims.
#include <gtest/gtest.h>

#include "tests/stability/table.h"
#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/unit/shapes/look.h"

namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;
using namespace tracer;
using stability::Oracle;
using stability::Row;

/// A cylinder or cone of height 1 over the xy plane, radius 1 below and `top` at z = 1, in its own render space.
struct Standing {
  std::shared_ptr<const CompiledScene> scene;
  Real top;

  Standing(double top_radius, bool caps) : top(top_radius) {
    Scene made = scenes::empty(1);
    if (top_radius == 1) {
      scenes::add(made, Cylinder{{0, 0, 0}, {0, 0, 1}, 1, caps, {}}, scenes::matte({1, 1, 1}));
    } else {
      scenes::add(made, Cone{{0, 0, 1}, {0, 0, 0}, 1, top_radius, caps, {}}, scenes::matte({1, 1, 1}));
    }
    scene = compiled(made);
  }

  /// Distance of the hit along the world-space ray; negative without a hit.
  [[nodiscard]] Real distance(const Vec& origin, const Vec& direction) const {
    const Look at = look(*scene, scene->frame.render_from_world(rounded(origin)), rounded(direction));
    return at.found ? scene->frame.world_from_render(at.hit.t) : -1.0L;
  }
};

bool near(Real a, Real b) { return std::fabs(a - b) <= 1e-13L * (1 + std::fabs(b)); }

TEST(RaysAlongTheAxis, HitCapsOrTheSideAtTheirDistanceFromTheAxis) {
  Row row(9, "cylinder, cone, truncated cone: rays along the axis", Oracle::closed_form, "rays");
  Random random(1);
  for (const double top : {1.0, 0.0, 0.4})
    for (const bool caps : {true, false}) {
      const Standing standing(top, caps);
      for (std::uint64_t i = 0; i < effort::cases(5'000); ++i) {
        const Real r = i % 5 == 0 ? 0 : random.in(0, 1.2), turn = random.in(0, 7);
        if (std::fabs(r - 1) < 1e-9L || std::fabs(r - Real(top)) < 1e-9L) continue;
        const Vec place(r * std::cos(turn), r * std::sin(turn), 0);
        const bool down = random.chance(0.5);
        const Real height = random.in(1.1, 9);
        // From above: the top cap, or the side at the height z where 1 - (1 - top) z = r. From below: the base, or the
        // side from within.
        const Real side = top == 1 ? -1 : (1 - r) / (1 - Real(top));
        const bool at_side = top != 1 && r > Real(top) && r < 1;
        Real expected = -1;
        if (at_side) expected = down ? height - side : height + side;
        if (caps && down && r < Real(top)) expected = height - 1;
        if (caps && !down && r < 1) expected = height;
        const Vec origin = place + Vec(0, 0, down ? height : -height);
        const Real found = standing.distance(origin, {0, 0, down ? -1.0L : 1.0L});
        row.expect(expected < 0 ? found < 0 : near(found, expected));
      }
    }
}

TEST(RaysNextToACone, NeverHitTheMirrorNappe) {
  Row row(9, "cone: the mirror nappe is not there", Oracle::closed_form, "rays");
  Random random(2);
  const Standing cone(0, true);
  for (std::uint64_t i = 0; i < effort::cases(30'000); ++i) {
    // Through the mirror nappe, perpendicular to the axis or rising from there.
    const Real z = 1 + static_cast<Real>(random.spread(1e-6, 1)), turn = random.in(0, 7);
    const Vec target((z - 1) * random.in(-1, 1), (z - 1) * random.in(-1, 1), z);
    const Vec direction =
        unit(Vec(std::cos(turn), std::sin(turn), random.chance(0.5) ? 0 : static_cast<Real>(random.spread(1e-9, 2))));
    const Real back = std::fmin(2.0L, direction.z > 0 ? (z - 1) / direction.z * 0.9L : 2.0L);
    row.expect(cone.distance(target - back * direction, direction) < 0);
  }
}

TEST(RaysThroughTheMirrorNappe, HitTheConeAtThePlaneSolution) {
  Row row(9, "cone: rays through both nappes", Oracle::closed_form, "rays");
  Random random(3);
  const Standing cone(0, false);
  for (std::uint64_t i = 0; i < effort::cases(30'000); ++i) {
    // In the half planes of one turn: from inside the mirror image to a point of the side, which is the first hit,
    // since a line meets each side of a plane's two once.
    const Real turn = random.in(0, 7), z = random.in(0.05, 0.95), over = random.in(0.05, 2);
    const auto place = [&](Real r, Real height) { return Vec(r * std::cos(turn), r * std::sin(turn), height); };
    const Vec target = place(1 - z, z), origin = place(over * random.in(-0.9, 0.9), 1 + over);
    // The other side, r = -(1 - z), may be hit before.
    const Real ro = dot(origin, place(1, 0)), dr = (1 - z) - ro, dz = z - origin.z;
    const Real s = (-(1 - origin.z) - ro) / (dr - dz);  // where ro + s dr = -(1 - (zo + s dz))
    const Real hit_distance = s > 0 && s < 1 && origin.z + s * dz < 1 && origin.z + s * dz > 0 ? s : 1;
    const Real whole = length(target - origin);
    const Real found = cone.distance(origin, unit(target - origin));
    row.expect(std::fabs(found - hit_distance * whole) <= 1e-11L * whole);
  }
}

TEST(RaysAtTheApex, HitTheApexOrNothingAndNeverLeaveFromInside) {
  Row row(9, "cone: the apex, from outside and from within", Oracle::closed_form, "rays");
  Random random(4);
  const Standing cone(0, true);
  for (std::uint64_t i = 0; i < effort::cases(30'000); ++i) {
    const bool within = random.chance(0.5);
    const Real turn = random.in(0, 7), r = random.in(0, 0.3);
    const Vec origin = within ? Vec(r * std::cos(turn), r * std::sin(turn), random.in(0.05, 0.6))
                              : Vec(3 * std::cos(turn), 3 * std::sin(turn), 1 + random.in(-1, 1));
    const Vec to = Vec(0, 0, 1) - Vec(rounded(origin));
    const Real found = cone.distance(origin, unit(to));
    row.expect(within ? found > 0 : found < 0 || std::fabs(found - length(to)) < 1e-6L);
  }
}

TEST(RaysAtARim, NeverLeaveFromInside) {
  Row row(9, "cylinder, cone, truncated cone: rims, from within", Oracle::conservation, "rays");
  Random random(5);
  for (const double top : {1.0, 0.0, 0.4}) {
    const Standing standing(top, true);
    for (std::uint64_t i = 0; i < effort::cases(15'000); ++i) {
      const Real turn = random.in(0, 7);
      const bool upper = top > 0 && random.chance(0.5);
      const Real r = upper ? Real(top) : 1;
      const Vec origin(random.in(-0.2, 0.2), random.in(-0.2, 0.2), random.in(0.05, 0.6));
      const Vec target(r * std::cos(turn), r * std::sin(turn), upper ? 1 : 0);
      row.expect(standing.distance(origin, unit(target - Vec(rounded(origin)))) > 0);
    }
  }
}

}  // namespace
