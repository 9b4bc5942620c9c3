#pragma once
/// What is known of a pixel while samples are being added to it in rounds.
///
/// Each round decides from all that came before it how many fresh samples a pixel gets; these, in two independent
/// halves, then estimate the error that is left. What decides and what estimates are thus different samples, so that
/// stopping where a pixel happens to look smooth does not make the estimate smaller than it is.

#include <array>
#include <cstdint>
#include <vector>

#include "tracer/src/accuracy/levels.h"
#include "tracer/src/math/vec.h"

namespace tracer {

struct PixelState {
  /// What this round does with the pixel.
  enum class Role : std::uint8_t {
    retained,  ///< nothing
    /// Chosen at random from those that were never refined, to tell what error is left in them. The fresh samples are
    /// for that alone: a single sample in the middle of a smooth pixel is better than its mean with a few others.
    audited,
    refined,
  };

  Color sum;                     ///< of the samples before this round
  std::array<Color, 2> fresh{};  ///< of this round's, in two halves
  std::uint32_t count = 0;       ///< of samples in `sum`
  std::array<std::uint32_t, 2> fresh_count{};
  /// Predicted variance of the mean, in squared levels, the channels added up.
  float variance = 0;
  float contrast = 0;  ///< to its neighbours, when there was one sample in each; squared levels
  Role role = Role::retained;
  bool refined_before = false;
  bool filled = false;  ///< there was no time for a sample of its own: `sum` is a neighbour's

  [[nodiscard]] std::uint32_t total() const { return count + fresh_count[0] + fresh_count[1]; }
  /// Of all its samples.
  [[nodiscard]] Color mean() const { return total() > 0 ? (sum + fresh[0] + fresh[1]) * (1.0 / total()) : Color{}; }
  /// Ends the round: a refined pixel's samples are known ones from now on.
  void absorb() {
    if (role == Role::refined) {
      sum = sum + fresh[0] + fresh[1];
      count = total();
      refined_before = refined_before || fresh_count[0] + fresh_count[1] > 0;
    }
    fresh = {};
    fresh_count = {};
    role = Role::retained;
  }
};

/// The error of a pixel, as this round's samples estimate it: in squared levels, the channels added up. Without bias
/// for whatever the samples before were, so it may be negative; only sums and means of many mean something.
struct PixelError {
  double before = 0;  ///< of the samples before this round alone
  double with = 0;    ///< with this round's
};

/// Precondition: this round gave the pixel at least one finite sample in each half.
///
/// With P the mean before, F1 and F2 those of the halves: given P, E[(P - F1)(P - F2)] = (P - mu)^2, and
/// E[(F1 - F2)^2 / 4] is the variance of their mean F; the combined mean w P + (1 - w) F has the error
/// w^2 (P - mu)^2 + (1 - w)^2 var F, the mixed term being zero.
PixelError error_of(const PixelState& pixel, const Levels& levels);

}  // namespace tracer
