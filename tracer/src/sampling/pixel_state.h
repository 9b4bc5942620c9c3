#pragma once
/// Sums over the samples of a pixel, and its state during adaptive sampling.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "tracer/image.h"
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
  /// Writes the variance of the samples to three channels; `squares` is the sum of their squares.
  void write_variance(const Color& squares, float* variance) const;

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

 private:
  std::uint32_t count_ = 0, hit_count_ = 0, object_id_ = 0;
  double depth_ = 0;
  Vec3 normal_;
  Color albedo_;
};

/// State of a pixel during adaptive sampling.
///
/// A pixel begins with a pilot: one sample, usually at its center. If that is not good enough the pixel is refined: a
/// sequence of samples starts and continues from round to round. Its mean is then the pixel, and the difference of its
/// two halves estimates the error. In every round, some pixels that have only their pilot are selected at random for
/// holdout: fresh samples measure the error of pilots that nothing else casts doubt on. The halves both decide where
/// sampling continues and estimate the error; the bias of that is left to the holdout samples that validate the image.
struct PixelState {
  enum class Role : std::uint8_t {
    pilot,    ///< its one sample is the pixel
    holdout,  ///< as pilot; the halves hold samples of this round that only estimate its error
    refined,  ///< the mean of the halves is the pixel
  };

  Color pilot;
  std::array<Color, 2> half{};  ///< sums
  std::array<std::uint32_t, 2> half_count{};
  float variance = 0;  ///< predicted for the pixel, in squared code values, summed over the channels
  float contrast = 0;  ///< contrast of the pilots around it, in the same unit
  /// A feature that the samples probably miss: the variance that it adds to one sample, the squared error of a pixel
  /// without it (both in squared code values), and the fraction of the pixel that it covers.
  float hidden = 0, missed = 0, hidden_share = 1;
  Role role = Role::pilot;
  bool grows = false;  ///< refined in this round

  [[nodiscard]] bool refined() const { return role == Role::refined; }
  /// True if both halves have samples.
  [[nodiscard]] bool measured() const { return half_count[0] > 0 && half_count[1] > 0; }
  /// Number of samples whose mean is the pixel.
  [[nodiscard]] std::uint32_t count() const {
    const std::uint32_t samples = half_count[0] + half_count[1];
    return refined() && samples > 0 ? samples : 1;
  }
  [[nodiscard]] Color mean() const {
    const bool begun = refined() && half_count[0] + half_count[1] > 0;
    return begun ? (half[0] + half[1]) * (1.0 / count()) : pilot;
  }
  /// Predicted error of a feature that has not been sampled yet: fewer than four samples are expected on it.
  [[nodiscard]] double undetected() const {
    const double likely = static_cast<double>(count()) * hidden_share;
    return likely < 4 ? std::max(static_cast<double>(hidden) / count(), missed * std::exp(-likely)) : 0;
  }
  /// Moves all samples to the first half, so that the sequence can continue in the second.
  void grow() {
    half[0] += half[1];
    half_count[0] += half_count[1];
    half[1] = {};
    half_count[1] = 0;
  }
  /// Discards the holdout samples at the end of the round.
  void discard_holdout() {
    if (role != Role::holdout) return;
    half = {};
    half_count = {};
    role = Role::pilot;
  }
};

/// The variance of a pixel's mean falls like the number of samples to this power: 1 for independent samples, 3/2 for
/// stratified ones at an edge (Mitchell 1996, "Consequences of Stratified Sampling in Graphics"), in between for
/// integrands of more dimensions. Used only for allocation, never for an estimate.
inline constexpr double variance_power = 1.35;

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

/// Refined pixel with the halves' means F1 and F2: (F1 - F2)^2 / 4. For independent halves this is the variance of the
/// mean; halves stratified together differ more. With a variance of c n^-p of n consecutive samples it is (2^p - 1)
/// times that variance: 1 for p = 1, 1.8 for edges.
double refined_error(const PixelState& pixel, const DisplayTransform& display);
/// Holdout pixel with the pilot P: E[(P - F1)(P - F2)] = (P - mu)^2 for any P. `usual`: usual radiance error of similar
/// pixels, the root of the mean of holdout_radiance_error() over many.
double holdout_error(const PixelState& pixel, const DisplayTransform& display, double usual);
/// Squared distance of the mean of the halves from the pilot: the squared error plus the variance of that mean.
double squared_distance(const PixelState& pixel, const DisplayTransform& display);
/// Squared error in squared radiance, mean of the channels.
double holdout_radiance_error(const PixelState& pixel);

}  // namespace tracer
