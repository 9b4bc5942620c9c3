#pragma once
/// Sums over the samples of a pixel, and errors of its value by independent halves of samples.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "tracer/image.h"
#include "tracer/src/display/display_transform.h"
#include "tracer/src/integrators/tracer.h"
#include "tracer/src/math/lanes.h"
#include "tracer/src/math/vec.h"

namespace tracer {

/// Allocates the image and the layers of `output`, all zero.
void allocate(Image& image, const PixelWindow& window, const Output& output);

/// Converts to the film's float; larger values become the largest finite one.
inline float film_value(double value) {
  return static_cast<float>(std::min<double>(value, std::numeric_limits<float>::max()));
}

inline constexpr double Color::*color_channels[] = {&Color::r, &Color::g, &Color::b};

/// Writes three channels.
inline void write_color(float* rgb, const Color& color) {
  rgb[0] = film_value(color.r);
  rgb[1] = film_value(color.g);
  rgb[2] = film_value(color.b);
}

/// Sum of one pixel's finite samples.
class PixelAccumulator {
 public:
  void add(const Color& radiance) {
    sum_ += radiance;
    ++count_;
  }
  /// Writes the mean to three channels.
  void write(float* rgb) const { write_color(rgb, count_ > 0 ? sum_ * (1.0 / count_) : Color{}); }
  /// Writes the standard deviation of the mean to three channels, estimated from the difference between the samples of
  /// `half` and the others: |F1 - F2| sqrt(n1 n2) / (n1 + n2).
  void write_deviation(const PixelAccumulator& half, float* deviation) const;

 private:
  Color sum_;
  std::uint32_t count_ = 0;
};

/// Sums of the first hits of one pixel's samples.
class LayerAccumulator {
 public:
  void add(const GBuffer& gbuffer, std::size_t sample);
  /// Adds the samples of `later`.
  void add(const LayerAccumulator& later);
  /// Writes the means to the layers of `image`.
  void write(Image& image, std::size_t index) const;
  /// Calls use(field...) with all fields of the accumulator `self`.
  template <class Self, class Use>
  static auto with_fields(Self& self, const Use& use) {
    return use(self.count_, self.hit_count_, self.object_id_, self.depth_, self.normal_, self.albedo_);
  }

 private:
  std::uint32_t count_ = 0, hit_count_ = 0, object_id_ = 0;
  double depth_ = 0;
  Vec3 normal_;
  Color albedo_;
};

/// The variance of a pixel's mean falls like the number of samples to this power: 1 for independent samples, 3/2 for
/// stratified ones at an edge (Mitchell 1996, "Consequences of Stratified Sampling in Graphics"), in between for
/// integrands of more dimensions.
inline constexpr double variance_power = 1.35;

/// Variance predicted from the contrast for one sample of a pixel. An edge of height h at a random position in the
/// pixel gives the center sample a squared error of h^2 / 12 in the mean. A fainter contrast is more likely a curve,
/// whose center is off by 1/24 of its second difference in each direction; twice that is predicted.
WHITTLE_INLINE double predicted_variance(double contrast) {
  constexpr double edge = 3 * 6 * 6;  // six code values in each channel; smooth shading may reach that
  return contrast >= edge ? contrast / 12 : contrast / 144;
}

/// Root mean square of the fraction p of a pixel that `count` samples have missed. With the prior of Jeffreys (1946,
/// "An invariant form for the prior probability in estimation problems"), p has the distribution Beta(1/2, n + 1/2).
inline double missed_share(double count) { return std::sqrt(0.75 / ((count + 1) * (count + 2))); }
/// Means of two fresh halves of samples of a pixel.
using Halves = std::array<Color, 2>;
/// Writes the means of samples in sequence, `half_size` for each half; nothing where a half has no finite one.
void average_halves(std::span<const Color> samples, std::uint32_t half_size, std::span<std::optional<Halves>> means);

/// Squared error of the pixel `value` by two independent halves, which have no part in it, in squared code values,
/// summed over the channels: (P - F1)(P - F2) in radiance, whose expectation is (P - mu)^2 whatever P is, times the
/// squared slope from P to the nearer half: the steep side, where the halves are far apart.
double fresh_error(const Color& value, const Halves& fresh, const DisplayTransform& display);

/// Distance between the limits of two kinds of samples of the pixel `value`, by two halves of each. With the same seeds
/// both have common noise, which cancels. Twice the square for the mean of the halves less the mean of their squares is
/// unbiased to the second order of the rest (jackknife: Quenouille 1956, "Notes on Bias in Estimation").
struct HalvesDistance {
  HalvesDistance(const Color& value, const Halves& a, const Halves& b, const DisplayTransform& display);
  double squared;  ///< in squared code values, summed over the channels; negative by chance
  double noise;    ///< variance of the difference of two halves, likewise
};

}  // namespace tracer
