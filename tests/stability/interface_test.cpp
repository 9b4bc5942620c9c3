// The critical angle to the last bit: reflectance and transmittance add up to one on both sides of it.
#include <gtest/gtest.h>

#include "tests/stability/layers.h"
#include "tests/stability/table.h"
#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tracer/src/math/optics.h"

namespace {

using oracle::Random;
using oracle::Real;
using namespace tracer;
using stability::Oracle;
using stability::Row;

/// Amplitudes at one interface: Born & Wolf 1999, eqs. 1.5.20 and 1.5.21. Precondition: no total reflection.
struct Amplitudes {
  Real r_s, r_p, t_s, t_p;
};

Amplitudes amplitudes(Real cos_i, Real cos_t, Real n1, Real n2) {
  return {(n1 * cos_i - n2 * cos_t) / (n1 * cos_i + n2 * cos_t), (n2 * cos_i - n1 * cos_t) / (n2 * cos_i + n1 * cos_t),
          2 * n1 * cos_i / (n1 * cos_i + n2 * cos_t), 2 * n1 * cos_i / (n2 * cos_i + n1 * cos_t)};
}

/// cos^2 of the refracted angle; below 0 at total reflection.
Real cos2_beyond(Real cos_i, Real n1, Real n2) { return 1 - (n1 / n2) * (n1 / n2) * (1 - cos_i) * (1 + cos_i); }

/// Power reflectance for a refracted cos^2 changed by `off`, the bound of its rounding error.
Real reflectance_near(Real cos_i, Real n1, Real n2, Real off) {
  const Real cos2_t = cos2_beyond(cos_i, n1, n2) + off;
  return cos2_t <= 0 ? 1 : oracle::reflectance(cos_i, std::sqrt(std::fmin(1.0L, cos2_t)), n1, n2);
}

TEST(CriticalAngle, IsContinuous) {
  Row reflectance(11, "critical angle +- 40 ulp: R, beside R at +- 4 roundings", Oracle::closed_form, "cosines");
  Row whole(11, "critical angle +- 40 ulp: R + T = 1 with T by its amplitudes", Oracle::conservation, "cosines");
  Random random(1);
  for (std::uint64_t i = 0; i < effort::cases(2'000); ++i) {
    const double n1 = random.chance(0.3) ? random.spread(3, 1e6) : random.in(1.0001, 3);
    const double n2 = random.in(0.4, n1 * 0.9999);
    double cos_i = std::sqrt((1 - n2 / n1) * (1 + n2 / n1));
    for (int ulp = 0; ulp < 40; ++ulp) cos_i = std::nextafter(cos_i, 0);
    double before = 1;
    for (int ulp = -40; ulp <= 40; ++ulp, cos_i = std::nextafter(cos_i, 1)) {
      const Interface found = dielectric_interface(cos_i, n1, n2);
      const Real error_bound = 16 * 0x1p-53L * (n1 / n2) * (n1 / n2);
      const Real high = reflectance_near(cos_i, n1, n2, -error_bound),
                 low = reflectance_near(cos_i, n1, n2, error_bound);
      // Continuous: no step is larger than that of the closed form over the error bound.
      reflectance.expect(found.reflectance <= high + 4e-16L && found.reflectance >= low - 4e-16L &&
                         std::fabs(found.reflectance - before) <= 2 * (high - low) + 4e-16L + (ulp == -40 ? 1 : 0));
      before = found.reflectance;
      const Real cos2_t = cos2_beyond(cos_i, n1, n2);
      Real transmitted = 0;
      if (cos2_t > 0) {
        const Real cos_t = std::sqrt(cos2_t);
        const Amplitudes a = amplitudes(cos_i, cos_t, n1, n2);
        transmitted = n2 * cos_t / (n1 * cos_i) * (a.t_s * a.t_s + a.t_p * a.t_p) / 2;
      }
      whole.expect(std::fabs(found.reflectance + transmitted - 1) <= high - low + 4e-16L);
    }
  }
}

TEST(Interface, SatisfiesStokesRelationsFromBothSides) {
  Row row(11, "Stokes: r = -r', tt' = 1 - r^2: R from behind is R", Oracle::conservation, "angles");
  Random random(2);
  for (std::uint64_t i = 0; i < effort::cases(100'000); ++i) {
    const double n1 = random.spread(0.3, 3), n2 = random.spread(0.3, 3), cos_i = random.in(0.001, 1);
    const Interface there = dielectric_interface(cos_i, n1, n2);
    // Near the critical angle the reverse direction is accurate only to the square root of a rounding error.
    if (there.total_internal_reflection || there.cos_t < 1e-3) continue;
    const Interface back = dielectric_interface(there.cos_t, n2, n1);
    const Real cos_t = std::sqrt(cos2_beyond(cos_i, n1, n2));
    const Amplitudes a = amplitudes(cos_i, cos_t, n1, n2), b = amplitudes(cos_t, cos_i, n2, n1);
    const Real stokes = 1 - (a.t_s * b.t_s + a.t_p * b.t_p) / 2;  // mean of r^2, from the amplitudes of both ways
    const Real slack = 1e-9L;
    row.expect(!back.total_internal_reflection && std::fabs(there.reflectance - back.reflectance) <= slack &&
               std::fabs(there.reflectance - stokes) <= slack && std::fabs(back.cos_t - cos_i) <= slack);
  }
}

}  // namespace
