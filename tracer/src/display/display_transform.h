#pragma once
/// The scale on which errors are told: what a display is to show, in steps of an 8-bit code, not rounded.

#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "tracer/scene.h"
#include "tracer/src/math/wide.h"

namespace tracer {

/// From linear radiance through exposure, overflow and the sRGB curve to [0, 255]. Read from tables of the curve, exact
/// to 1e-3 levels: it is asked for every pixel. Any thread.
class DisplayTransform {
 public:
  /// `brightest`: the image's largest channel, which `overflow: scale` divides by.
  DisplayTransform(const Output& output, double brightest);

  [[nodiscard]] double level(double radiance) const { return of(level_, displayed(radiance)); }
  /// The same of a row of an image, three channels a pixel, into a plane for each, which have room for it.
  void show(std::span<const float> rgb, std::array<std::vector<float>, 3>& planes) const;
  /// Levels per unit of radiance; 0 above what is clamped.
  [[nodiscard]] double slope(double radiance) const;
  /// Levels per unit between two radiances, in any order; the slope where they are one.
  [[nodiscard]] double slope_between(double a, double b) const;
  /// The radiance from which on everything looks the same; infinite with reinhard.
  [[nodiscard]] double white() const { return white_; }

 private:
  static constexpr int steps = 4096;  ///< of the tables, over the square root of what is displayed

  [[nodiscard]] WHITTLE_INLINE double displayed(double radiance) const {
    const double exposed = (radiance > 0 ? radiance : 0) * gain_;
    return reinhard_ ? exposed / (1 + exposed) : exposed < 1 ? exposed : 1.0;
  }
  /// Between the table's entries on a line.
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
  const std::vector<float>&level_, &slope_;  ///< of display values, over their square root
};

}  // namespace tracer
