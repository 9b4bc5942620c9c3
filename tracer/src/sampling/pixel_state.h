#pragma once
/// What is known of a pixel while samples are being added to it in rounds.
///
/// A pixel begins with a pilot: one sample, in its centre where there is one. Where that is not good enough the pixel
/// is refined: a sequence of samples is begun and goes on from round to round. Its mean is then the pixel, and how far
/// its first and second half are apart tells the error. Of the pixels that are left with their pilot some are audited
/// in every round, chosen by nothing but chance: fresh samples tell what is wrong with a pilot nobody had a reason to
/// doubt. The halves decide where to go on as well as tell the error; what that hides is for the audit to find that
/// closes every image.

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "tracer/src/display/display_transform.h"
#include "tracer/src/math/vec.h"

namespace tracer {

struct PixelState {
  enum class Role : std::uint8_t {
    pilot,    ///< its one sample is the pixel
    audited,  ///< likewise; the halves hold samples of this round that only tell its error
    refined,  ///< the mean of the halves is the pixel
  };

  Color pilot;
  std::array<Color, 2> half{};  ///< sums
  std::array<std::uint32_t, 2> half_count{};
  float variance = 0;  ///< to be expected of the pixel, in squared levels, the channels added up
  float contrast = 0;  ///< of the pilots around it; in the same unit
  /// Something in the pixel that its samples are likely to miss: the variance that it gives one sample, and the squared
  /// error of a pixel without it, both in squared levels; the part of the pixel that it covers.
  float hidden = 0, missed = 0, hidden_share = 1;
  Role role = Role::pilot;
  bool grows = false;  ///< gets samples in this round, other than of an audit

  [[nodiscard]] bool refined() const { return role == Role::refined; }
  /// Whether both halves have samples, and so tell an error.
  [[nodiscard]] bool measured() const { return half_count[0] > 0 && half_count[1] > 0; }
  /// Of the samples whose mean the pixel is.
  [[nodiscard]] std::uint32_t count() const {
    const std::uint32_t samples = half_count[0] + half_count[1];
    return refined() && samples > 0 ? samples : 1;
  }
  [[nodiscard]] Color mean() const {
    const bool begun = refined() && half_count[0] + half_count[1] > 0;
    return begun ? (half[0] + half[1]) * (1.0 / count()) : pilot;
  }
  /// The error to be expected of what samples cannot speak of yet: where four of them are likely on it, they do.
  [[nodiscard]] double unseen() const {
    const double likely = static_cast<double>(count()) * hidden_share;
    return likely < 4 ? std::max(static_cast<double>(hidden) / count(), missed * std::exp(-likely)) : 0;
  }
  /// Makes room for more samples of the sequence: all that there are belong to its first half.
  void grow() {
    half[0] += half[1];
    half_count[0] += half_count[1];
    half[1] = {};
    half_count[1] = 0;
  }
  /// Ends the round.
  void forget_audit() {
    if (role != Role::audited) return;
    half = {};
    half_count = {};
    role = Role::pilot;
  }
};

/// The variance of a pixel's mean falls like its samples' number to this power: independent samples have 1, stratified
/// ones 3/2 at an edge (Mitchell 1996, "Consequences of Stratified Sampling in Graphics") and between for what has more
/// dimensions than the pixel's square. Used for planning alone, never for an estimate.
inline constexpr double variance_power = 1.35;

/// What `variance` of a mean would be of one sample.
double variance_of_one(double variance, std::uint32_t count);

// Estimates of the squared error of a pixel, in squared levels, the channels added up. As radiance they are without
// bias or too large, and may be negative; only sums and means of many mean something. The curve from radiance to levels
// bends, most next to black: its slope is taken over a range of radiance, on the steep side. Precondition: measured().

/// Of a refined pixel with the halves' means F1 and F2: (F1 - F2)^2 / 4. Were they independent its mean would be the
/// variance of theirs; stratified together they differ by more. With a variance of c n^-p of n samples in a row it is
/// (2^p - 1) times that variance: 1 for p = 1, 1.8 for edges.
double refined_error(const PixelState& pixel, const DisplayTransform& levels);
/// Of an audited one with the pilot P: E[(P - F1)(P - F2)] = (P - mu)^2, whatever P is. `usual`: how far off, as
/// radiance, pixels like this one are: the root of the mean of audited_radiance_error over many.
double audited_error(const PixelState& pixel, const DisplayTransform& levels, double usual);
/// How far the mean of the halves is from the pilot: more than its squared error by the variance of that mean.
double squared_distance(const PixelState& pixel, const DisplayTransform& levels);
/// The squared error in squared radiance, the mean of the channels.
double audited_radiance_error(const PixelState& pixel);

}  // namespace tracer
