#pragma once
/// Display values in levels (steps of an 8-bit code, not rounded), the scale of all errors.

#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "tracer/scene.h"
#include "tracer/src/math/lanes.h"

namespace tracer {

/// Maps linear radiance through exposure, overflow and the sRGB curve to [0, 255]. Uses tables of the curve, accurate
/// to 1e-3 levels, because it is evaluated for every pixel. Any thread.
class DisplayTransform {
 public:
  /// `brightest`: the image's largest channel, which `overflow: scale` divides by.
  DisplayTransform(const Output& output, double brightest);

  [[nodiscard]] double level(double radiance) const { return of(level_, displayed(radiance)); }
  /// The same for a row of RGB pixels, to one plane per channel.
  void show(std::span<const float> rgb, const std::array<float*, 3>& planes) const;
  void show(std::span<const float> rgb, std::array<std::vector<float>, 3>& planes) const {
    show(rgb, {planes[0].data(), planes[1].data(), planes[2].data()});
  }
  /// Derivative: levels per unit of radiance; 0 for clamped radiance.
  [[nodiscard]] double slope(double radiance) const;
  /// Difference quotient between two radiances, in any order; the derivative if they are equal.
  [[nodiscard]] double slope_between(double a, double b) const;
  /// Radiance above which the display value is constant; infinite with reinhard.
  [[nodiscard]] double white() const { return white_; }

 private:
  static constexpr int steps = 4096;  ///< table size, uniform in the square root of the display value

  [[nodiscard]] WHITTLE_INLINE double displayed(double radiance) const {
    const double exposed = (radiance > 0 ? radiance : 0) * gain_;
    return reinhard_ ? exposed / (1 + exposed) : exposed < 1 ? exposed : 1.0;
  }
  /// Linear interpolation in a table.
  [[nodiscard]] WHITTLE_INLINE static double of(const std::vector<float>& table, double displayed) {
    const double at = std::sqrt(displayed) * steps;
    const int whole = static_cast<int>(at), index = whole < steps ? whole : steps - 1;
    const float* const entry = table.data() + index;
    return entry[0] + (entry[1] - entry[0]) * (at - index);
  }
  template <class Curve>
  static std::vector<float> tabulated(const Curve& curve);
  static const std::vector<float>& level_table();
  static const std::vector<float>& slope_table();

  bool reinhard_ = false;
  double gain_ = 1, white_ = 1;
  const std::vector<float>&level_, &slope_;  ///< tables over the square root of the display value
};

}  // namespace tracer
