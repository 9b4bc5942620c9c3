#pragma once
/// Which pixels the closing audit of a picture looks at, and how closely.

#include <cstdint>
#include <span>
#include <vector>

#include "tracer/src/accuracy/pixel_state.h"

namespace tracer {

/// A pixel chosen by chance to tell the error of a picture.
struct AuditChoice {
  std::size_t place = 0;
  std::uint32_t half = 0;  ///< fresh samples in each of two halves
  double stands_for = 0;   ///< how many pixels' errors its own counts as
};

/// Every pixel is looked at with a chance that spends equally many samples on each in the mean, four or, of large
/// pictures, an eighth of one: of a small picture all that have cost little are looked at, since a single pixel may be
/// what is wrong with it; those that have cost much are known better, and to look at them costs more. That finds what
/// nobody expects. What is expected is told best where it is: refined pixels are drawn another 256 times, with a chance
/// in proportion to the error that is expected of them (importance sampling: Cochran 1977, "Sampling Techniques", sec.
/// 9A), one draw in each of as many equal parts of it. Their number is what the confidence wants, however large the
/// picture is. What a choice stands for makes the sum unbiased, whatever was expected.
///
/// Ascending, each pixel once. Deterministic in `stream` and `seed`.
std::vector<AuditChoice> choose_audits(std::span<const PixelState> pixels, std::uint64_t stream, std::uint64_t seed);

}  // namespace tracer
