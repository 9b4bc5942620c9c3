#pragma once
/// The scale on which errors are told: what a display is to show, in steps of an 8-bit code, not rounded.

#include <array>
#include <span>
#include <vector>

#include "tracer/scene.h"

namespace tracer {

/// From linear radiance through exposure, overflow and the sRGB curve to [0, 255]. Read from tables of the curve, exact
/// to 1e-3 levels: it is asked for every pixel. Any thread.
class Levels {
 public:
  /// `brightest`: the picture's largest channel, which `overflow: scale` divides by.
  Levels(const Output& output, double brightest);

  [[nodiscard]] double level(double radiance) const { return of(level_, displayed(radiance)); }
  /// The same of a row of a picture, three channels a pixel, into a plane for each, which have room for it.
  void show(std::span<const float> rgb, std::array<std::vector<float>, 3>& planes) const;
  /// Levels per unit of radiance; 0 above what is clamped.
  [[nodiscard]] double slope(double radiance) const;
  /// Levels per unit between two radiances, in any order; the slope where they are one.
  [[nodiscard]] double slope_between(double a, double b) const;
  /// The radiance from which on everything looks the same; infinite with reinhard.
  [[nodiscard]] double white() const { return white_; }

 private:
  [[nodiscard]] double displayed(double radiance) const;
  [[nodiscard]] static double of(const std::vector<float>& table, double displayed);

  bool reinhard_ = false;
  double gain_ = 1, white_ = 1;
  const std::vector<float>&level_, &slope_;  ///< of display values, over their square root
};

}  // namespace tracer
