#pragma once
/// Sums over the samples of a pixel, and its state during adaptive sampling.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "tracer/image.h"
#include "tracer/src/certify/pixel_bounds.h"
#include "tracer/src/display/display_transform.h"
#include "tracer/src/integrators/tracer_concept.h"
#include "tracer/src/math/lanes.h"
#include "tracer/src/math/vec.h"

namespace tracer {

/// Allocates the image and the layers of `output`, all zero.
void allocate(Image& image, const PixelWindow& window, const Output& output);

/// Converts to the film's float; larger values become the largest finite one.
inline float film_value(double value) {
  return static_cast<float>(std::min<double>(value, std::numeric_limits<float>::max()));
}

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

/// State of a pixel during adaptive sampling.
///
/// A pixel begins with a pilot: one sample, usually at its center. If that is not good enough the pixel is refined: two
/// sequences of samples that are independent of each other and of the pilot start, one for each half, and continue from
/// round to round. The mean of the halves is then the pixel, and their difference estimates its error without bias,
/// because nothing that decides the number of a pixel's samples depends on its own halves.
///
/// Pixels that keep their pilot are validated by looks: fresh halves of randomly drawn pixels (looks.h).
struct PixelState {
  enum class Role : std::uint8_t {
    pilot,    ///< its one sample is the pixel
    refined,  ///< the mean of the halves is the pixel
  };

  Color pilot;
  std::array<Color, 2> half{};  ///< sums
  std::array<std::uint32_t, 2> half_count{};
  std::array<float, 3> squares{};  ///< sums over the samples of both halves
  float variance = 0;              ///< predicted for the pixel, in squared code values, summed over the channels
  /// The same with the pixel's own halves: for the layer `error` and the tiles, never for a decision.
  float shown = 0;
  float contrast = 0;  ///< contrast of the pilots around it, in the same unit
  /// Upper bound of the squared error of the pilot and of the squared distance of any two samples, in the same unit.
  float bound = 3 * 255 * 255;
  /// A feature that the samples probably miss: the variance that it adds to one sample, the squared error of a pixel
  /// without it (both in squared code values), and the fraction of the pixel that it covers.
  float hidden = 0, missed = 0, hidden_share = 1;
  std::uint16_t looks = 0;  ///< number of looks at the pilot
  Role role = Role::pilot;
  bool edge = false;       ///< not covered by one smooth surface: features may be smaller than the pixel
  bool certified = false;  ///< the bound is so small that the pilot suffices
  bool repaired = false;   ///< refined because a look found an error
  bool suspected = false;  ///< `variance` is that of what the samples may have missed

  [[nodiscard]] bool refined() const { return role == Role::refined; }
  /// True if a half has samples.
  [[nodiscard]] bool begun() const { return half_count[0] + half_count[1] > 0; }
  /// True if both halves have samples.
  [[nodiscard]] bool measured() const { return half_count[0] > 0 && half_count[1] > 0; }
  /// True if looks validate the pixel.
  [[nodiscard]] bool open() const { return !refined() && !certified; }
  /// Number of samples whose mean is the pixel.
  [[nodiscard]] std::uint32_t count() const { return refined() && begun() ? half_count[0] + half_count[1] : 1; }
  [[nodiscard]] Color mean() const { return refined() && begun() ? (half[0] + half[1]) * (1.0 / count()) : pilot; }
  void add_square(const Color& radiance) {
    squares[0] += film_value(radiance.r * radiance.r);
    squares[1] += film_value(radiance.g * radiance.g);
    squares[2] += film_value(radiance.b * radiance.b);
  }
  /// Predicted error of a feature that has not been sampled yet: fewer than four samples are expected on it.
  [[nodiscard]] double undetected() const {
    const double likely = static_cast<double>(count()) * hidden_share;
    return likely < 4 ? std::max(static_cast<double>(hidden) / count(), missed * std::exp(-likely)) : 0;
  }
};

/// The variance of a pixel's mean falls like the number of samples to this power: 1 for independent samples, 3/2 for
/// stratified ones at an edge (Mitchell 1996, "Consequences of Stratified Sampling in Graphics"), in between for
/// integrands of more dimensions. Used only for allocation, never for an estimate.
inline constexpr double variance_power = 1.35;
/// The same for what the samples may have missed; see missed_share().
inline constexpr double missed_power = 2.5;

/// Variance predicted from the contrast for one sample of a pixel. An edge of height h at a random position in the
/// pixel gives the center sample a squared error of h^2 / 12 in the mean. A fainter contrast is more likely a curve,
/// whose center is off by 1/24 of its second difference in each direction; twice that is predicted.
WHITTLE_INLINE double predicted_variance(double contrast) {
  constexpr double edge = 3 * 6 * 6;  // six code values in each channel; smooth shading may reach that
  return contrast >= edge ? contrast / 12 : contrast / 144;
}

/// Variance of one sample, from the variance of the mean of `count`.
double variance_of_one(double variance, std::uint32_t count);

// Estimates of the squared error of a pixel, in squared code values, summed over the channels. In radiance they are
// unbiased or too large, and may be negative: only sums and means of many are meaningful. The curve from radiance to
// code values is steepest next to black: its slope is taken over a range of radiance, on the steep side.
// Precondition: measured().

/// Refined pixel with the halves' means F1 and F2: (F1 - F2)^2 / 4, the variance of the mean of independent halves.
/// Where the mean is white, halves that are both too bright look equal: there the error is what the deviation of the
/// samples allows below white.
double refined_error(const PixelState& pixel, const DisplayTransform& display);
/// The same in code values, which is at most a quarter of the pixel's bound.
double bounded_refined_error(const PixelState& pixel, const DisplayTransform& display);
/// Standard deviation of the mean of a channel, as if the samples were independent. Precondition: more than one sample.
double deviation_of_mean(const PixelState& pixel, std::size_t channel);
/// The same, of halves that are stratified, if nothing but the position in the pixel depends on chance. The samples hit
/// a feature of the fraction p and some height h. If it is compact, its perimeter is about 4 sqrt(p), which crosses
/// some (4 / pi) 4 sqrt(p) sqrt(m) of the m strata of a half. The variance within one of these is h^2 / 6 in the mean
/// over the places of an edge, that within the others is 0. Relative to p (1 - p) h^2 / m, the variance of m
/// independent samples, that of the half is 8 / (3 pi (1 - p) sqrt(p m)). The deviation is at least that of the two
/// halves. Precondition: measured().
double stratified_deviation_of_mean(const PixelState& pixel, std::size_t channel);
/// Squared error that is expected from the deviation of all samples, if stratification helps half as much as usual
/// (`variance_power`). Halves with few hits often agree by chance; this has more degrees of freedom.
double expected_refined_error(const PixelState& pixel, const DisplayTransform& display);

/// Number of samples that differ from the pilot, if all of them differ alike.
double effective_hits(const PixelState& pixel);
/// Squared height of the feature that these samples hit, in squared code values, summed over the channels: a part p of
/// height h has the variance p (1 - p) h^2. Precondition: more than one sample.
double squared_height(const PixelState& pixel, const DisplayTransform& display);

/// Root mean square of the fraction p of a pixel that `count` samples have missed. With the prior of Jeffreys (1946,
/// "An invariant form for the prior probability in estimation problems"), p has the distribution Beta(1/2, n + 1/2).
inline double missed_share(double count) { return std::sqrt(0.75 / ((count + 1) * (count + 2))); }
/// Squared error of the pixel `value` without a part of `share` that is as dark or as bright as the finite interval
/// allows.
double missed_error(const Color& value, const RadianceInterval& interval, double share,
                    const DisplayTransform& display);
/// The brightest channel of a sample, if the others are black; less if they are not.
double brightest_sample(const PixelState& pixel);

/// Means of two fresh halves of samples of a pixel.
using Halves = std::array<Color, 2>;
/// Writes the means of samples in sequence, `half_size` for each half; nothing where a half has no finite one.
void average_halves(std::span<const Color> samples, std::uint32_t half_size, std::span<std::optional<Halves>> means);

/// Squared error of the pixel `value` by two independent halves, which have no part in it.
struct FreshError {
  /// Sum over the channels of (P - F1)(P - F2) in radiance, whose expectation is (P - mu)^2 whatever P is, times the
  /// squared slope from P to the nearer half: the steep side, where the halves are far apart.
  double squared = 0;
  /// Sum of (P - F1)(P - F2) in code values, which is within the pixel's bound. Its expectation is the squared distance
  /// to the mean code value of a half, which is a little darker than the code value of the mean (Jensen).
  double bounded = 0;
};
FreshError fresh_error(const Color& value, const Halves& fresh, const DisplayTransform& display);

/// Distance between the limits of two kinds of samples of the pixel `value`, by two halves of each. With the same seeds
/// both have common noise, which cancels. Twice the square for the mean of the halves less the mean of their squares is
/// unbiased to the second order of the rest (jackknife: Quenouille 1956, "Notes on Bias in Estimation").
struct HalvesDistance {
  HalvesDistance(const Color& value, const Halves& a, const Halves& b, const DisplayTransform& display);
  double squared;  ///< in squared code values, summed over the channels; negative by chance
  double noise;    ///< variance of the difference of two halves, likewise
};

/// The largest squared distance of any two samples of a pixel, in squared code values, summed over the channels.
float squared_error_bound(const RadianceInterval& interval, const DisplayTransform& display);
/// The largest squared distance of a sample from `value`, which may lie outside of the interval.
float squared_distance_bound(const RadianceInterval& interval, const Color& value, const DisplayTransform& display);

}  // namespace tracer
