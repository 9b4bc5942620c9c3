// Reflection and refraction compared with Snell and Fresnel in long double.
#include "tracer/src/math/optics.h"

#include <gtest/gtest.h>

#include "tests/support/effort.h"
#include "tests/support/random.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;

constexpr Real unit_roundoff = 0x1p-53L;

struct Amplitudes {
  Real r_s, r_p, cos_t;
};

/// Born & Wolf 1999, eqs. 1.5.20 and 1.5.21. Precondition: no total internal reflection.
Amplitudes fresnel(Real c, Real n1, Real n2) {
  const Real sin2_t = (n1 / n2) * (n1 / n2) * (1 - c) * (1 + c);
  const Real ct = std::sqrt(1 - sin2_t);
  return {(n1 * c - n2 * ct) / (n1 * c + n2 * ct), (n2 * c - n1 * ct) / (n2 * c + n1 * ct), ct};
}

/// A unit direction on the normal's side, from normal incidence to grazing.
struct LightSamplePacket {
  Vec3 d, n;
  double cos_i;
};

LightSamplePacket arrival(Random& random) {
  const Vec n = random.direction(), across = random.across(n);
  const Real c = random.chance(0.3)   ? random.spread(1e-8, 1)
                 : random.chance(0.5) ? 1 - random.spread(1e-16, 1)
                                      : random.in(0.001, 1);
  LightSamplePacket a{rounded(unit(std::sqrt((1 - c) * (1 + c)) * across - c * n)), rounded(n), 0};
  a.cos_i = std::min(1.0, -dot(a.d, a.n));
  return a;
}

TEST(Reflection, HasEqualAnglesInThePlaneOfIncidence) {
  Random random(1);
  for (std::uint64_t i = 0; i < effort::cases(100'000); ++i) {
    const LightSamplePacket a = arrival(random);
    const Vec r = reflected(a.d, a.n), d = a.d, n = a.n;
    ASSERT_LE(std::fabs(dot(r, n) + dot(d, n)), 8 * unit_roundoff);
    ASSERT_LE(length((r - dot(r, n) * n) - (d - dot(d, n) * n)), 8 * unit_roundoff);
  }
}

TEST(Refraction, FollowsSnellInThePlaneOfIncidence) {
  Random random(2);
  std::uint64_t refracted_count = 0;
  for (std::uint64_t i = 0; i < effort::cases(100'000); ++i) {
    const LightSamplePacket a = arrival(random);
    const double n1 = random.spread(0.1, 10), n2 = random.chance(0.1) ? n1 : random.spread(0.1, 10);
    const Interface interface = dielectric_interface(a.cos_i, n1, n2);
    if (interface.total_internal_reflection) continue;
    ++refracted_count;
    const Vec t = refracted(a.d, a.n, a.cos_i, interface.cos_t, n1, n2), d = a.d, n = a.n;
    const Vec along_in = d - dot(d, n) * n, along_out = t - dot(t, n) * n;
    // The part along the surface is scaled by n1/n2; its rounding grows with that, and with 1/cos_t near the critical
    // angle, where a last bit of the cosine moves the ray by its square root.
    const Real tolerance = 16 * unit_roundoff * (1 + n1 / n2) * (1 + n1 / n2) / std::fmax(interface.cos_t, 1e-8);
    ASSERT_LE(length(static_cast<Real>(n2) * along_out - static_cast<Real>(n1) * along_in), tolerance * n2)
        << "cos_i " << a.cos_i << " n " << n1 << " to " << n2;
    ASSERT_LE(dot(t, n), 0);
    ASSERT_NEAR(static_cast<double>(length(t)), 1, 4e-16);
  }
  EXPECT_GT(refracted_count, effort::cases(100'000) / 3);
}

TEST(Fresnel, AgreesWithTheAmplitudesForEveryAngleAndIndexFromAMillionthToAMillion) {
  Random random(4);
  for (std::uint64_t i = 0; i < effort::cases(300'000); ++i) {
    const double n1 = random.chance(0.5) ? 1 : random.spread(1e-3, 1e3), n2 = n1 * random.spread(1e-6, 1e6);
    const double c = random.chance(0.5)    ? random.in(0, 1)
                     : random.chance(0.5)  ? random.spread(1e-12, 1)
                     : random.chance(0.99) ? 1 - random.spread(1e-16, 1)
                                           : random.below(2);  // grazing or normal, exactly
    const Interface interface = dielectric_interface(c, n1, n2);
    const Real sin2_t = (Real(n1) / n2) * (Real(n1) / n2) * (1 - Real(c)) * (1 + Real(c));
    if (std::fabs(sin2_t - 1) < 1e-12L) continue;  // stability/dielectric_test.cpp has the critical angle
    ASSERT_EQ(interface.total_internal_reflection, sin2_t > 1);
    if (sin2_t > 1) {
      ASSERT_EQ(interface.reflectance, 1);
      continue;
    }
    const Amplitudes f = fresnel(c, n1, n2);
    const Real expected = (f.r_s * f.r_s + f.r_p * f.r_p) / 2;
    // Only the critical angle is ill-conditioned: there a last bit of the cosine or of an index matters.
    const Real squared = (Real(n2) / n1) * (Real(n2) / n1) * f.cos_t * f.cos_t;
    const Real conditioning = 1 + std::fmin(Real(c) * c, Real(n2) * n2 / (Real(n1) * n1)) / squared;
    ASSERT_LE(std::fabs(interface.reflectance - expected), 16 * unit_roundoff * expected * conditioning + 1e-18L)
        << "cos_i " << c << " n " << n1 << " to " << n2 << " expected " << expected;
    ASSERT_LE(std::fabs(interface.cos_t - f.cos_t), 8 * unit_roundoff * f.cos_t * conditioning);
  }
}

TEST(Fresnel, KeepsItsDigitsForNearlyEqualIndices) {
  // To first order in the difference: r_s = -delta / 2c^2, r_p = delta (2c^2 - 1) / 2c^2.
  for (int ulps = 1; ulps < 1'000'000; ulps *= 3)
    for (const Real sign : {1.0L, -1.0L})
      for (const double c : {1.0, 0.9, 0.5, 0.2}) {
        const Real delta = sign * ulps * 0x1p-52L;
        const auto n = static_cast<double>(1 + delta);
        const Real s = delta / (2 * c * c), p = s * (2 * c * c - 1);
        const auto expected = static_cast<double>((s * s + p * p) / 2);
        ASSERT_NEAR(dielectric_interface(c, 1, n).reflectance, expected, 2e-8 * expected) << delta << " " << c;
      }
  EXPECT_EQ(dielectric_interface(0.3, 1.5, 1.5).reflectance, 0);
}

}  // namespace
}  // namespace tracer
