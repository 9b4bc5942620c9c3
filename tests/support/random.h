#pragma once
/// Random numbers for tests, equal in every run and on every machine (the results of the standard distributions are
/// implementation-defined).

#include <cmath>
#include <cstdint>
#include <random>

#include "tests/support/long_vec.h"
#include "tracer/scene.h"

namespace oracle {

class Random {
 public:
  explicit Random(std::uint64_t seed) : bits_(seed) {}

  double in(double low, double high) { return low + (high - low) * (static_cast<double>(bits_() >> 11) * 0x1p-53); }
  /// Logarithmically uniform; 0 < low.
  double spread(double low, double high) { return std::exp(in(std::log(low), std::log(high))); }
  bool chance(double p) { return in(0, 1) < p; }
  double sign() { return chance(0.5) ? 1 : -1; }
  std::uint32_t below(std::uint32_t count) { return static_cast<std::uint32_t>(bits_() % count); }
  tracer::Vec3 vector(double reach) { return {in(-reach, reach), in(-reach, reach), in(-reach, reach)}; }
  tracer::Color color(double low = 0) { return {in(low, 1), in(low, 1), in(low, 1)}; }

  /// Unit vector, uniform over the sphere.
  Vec direction() {
    for (;;) {
      const Vec v = vector(1);
      if (length(v) <= 1 && length(v) > 0.1L) return unit(v);
    }
  }
  /// Unit vector, perpendicular to the unit vector `n`.
  Vec across(const Vec& n) { return unit(cross(n, unit(direction() + 2 * cross(n, direction())))); }

 private:
  std::mt19937_64 bits_;
};

}  // namespace oracle
