#pragma once
/// Which pixels the closing audit of an image looks at, and how closely.

#include <cstdint>
#include <span>
#include <vector>

#include "tracer/src/sampling/pixel_state.h"

namespace tracer {

/// A pixel chosen by chance to tell the error of an image.
struct HoldoutPixel {
  std::size_t place = 0;
  std::uint32_t half = 0;  ///< fresh samples in each of two halves
  double stands_for = 0;   ///< how many pixels' errors its own counts as
};

/// How much an audit looks at.
struct AuditSize {
  /// Pixels that have only their pilot would be looked at so many times, were all like that.
  double looks = 0;
  /// Refined pixels are drawn so often beside that. 256: what the confidence wants, however large the image is.
  std::uint32_t draws = 256;
};

/// What an image with a target is audited by: one look for 32 pixels, or 2048 of them, so that of a small image all
/// are looked at: a single pixel may be what is wrong with it.
AuditSize thorough_audit(std::size_t pixels);
/// The same as far as it costs no more than so many samples; and little even if that is none.
AuditSize audit_within(std::span<const PixelState> pixels, double samples_most);

/// Every pixel is looked at with a chance that spends equally many samples on each in the mean: those that have cost
/// much are known better, and to look at them costs more. That finds what nobody expects. What is expected is told best
/// where it is: refined pixels are also drawn with a chance in proportion to the error that is expected of them
/// (importance sampling: Cochran 1977, "Sampling Techniques", sec. 9A), one draw in each of as many equal parts of it.
/// What a choice stands for makes the sum unbiased, whatever was expected.
///
/// Ascending, each pixel once. Deterministic in `stream` and `seed`.
std::vector<HoldoutPixel> choose_audits(std::span<const PixelState> pixels, const AuditSize& size, std::uint64_t stream,
                                        std::uint64_t seed);

/// Of so many pixels of which nothing is known, `count` at most: one in each of as many equal parts.
std::vector<HoldoutPixel> choose_audits(std::size_t pixels, std::size_t count, std::uint64_t stream,
                                        std::uint64_t seed);

}  // namespace tracer
