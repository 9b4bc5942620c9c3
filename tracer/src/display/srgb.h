#pragma once
/// sRGB transfer function (IEC 61966-2-1:1999, clause 5.2), from linear values to codes. Pure functions, any thread.

#include <cstdint>
#include <span>

namespace tracer {

/// The exact piecewise curve in both directions; defined on [0,1] and continued beyond 1 with the same power.
double srgb_from_linear(double linear);
double linear_from_srgb(double encoded);

/// The code nearest to 255 x srgb_from_linear(linear), exactly as if computed without rounding on the way; linear is
/// clamped to [0,1] first. NaN gives 0.
std::uint8_t srgb8_from_linear(float linear);

/// The same for 16 bits: nearest to 65535 x srgb_from_linear(linear).
std::uint16_t srgb16_from_linear(float linear);

/// The same for an array. Precondition: equal sizes.
void srgb8_from_linear(std::span<const float> linear, std::span<std::uint8_t> codes);
void srgb16_from_linear(std::span<const float> linear, std::span<std::uint16_t> codes);

}  // namespace tracer
