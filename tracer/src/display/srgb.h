#pragma once
/// From linear light to the bytes a screen expects: the sRGB transfer function (IEC 61966-2-1:1999, clause 5.2).
/// Pure functions; any thread.

#include <cstdint>
#include <span>

namespace tracer {

/// The exact piecewise curve, both ways; meant for [0,1], continued beyond 1 by the same power.
double srgb_from_linear(double linear);
double linear_from_srgb(double encoded);

/// The code nearest to 255 x srgb_from_linear(linear), exactly as if computed without rounding on the way; linear is
/// clamped to [0,1] first. Not-a-number gives 0, the darkest wrong answer.
std::uint8_t srgb8_from_linear(float linear);

/// Likewise, of 65535.
std::uint16_t srgb16_from_linear(float linear);

/// The same for a whole row or image. Precondition: equal sizes.
void srgb8_from_linear(std::span<const float> linear, std::span<std::uint8_t> codes);
void srgb16_from_linear(std::span<const float> linear, std::span<std::uint16_t> codes);

}  // namespace tracer
