#pragma once
/// Box filter: means of one-dimensional patterns over an interval, in closed form. Intervals are first reduced to the
/// nearest integer, which is exact, so that neither huge coordinates nor tiny widths suffer from cancellation.

#include <algorithm>
#include <cmath>

#include "tracer/scene.h"

namespace tracer {

/// Largest |coordinate| or width that is evaluated: beyond 2^53 a double has no fraction.
inline constexpr double coordinate_reach = 0x1p100;

inline bool is_even(double whole) { return std::floor(whole * 0.5) * 2 == whole; }

/// Mean over [x - width/2, x + width/2] of the function that is 1 where floor is even and -1 where it is odd.
inline double alternating_mean(double x, double width) {
  const double low = std::floor(x - width / 2);
  if (!(width > 0) || low == std::floor(x + width / 2)) return is_even(std::floor(x)) ? 1 : -1;
  const double whole = std::nearbyint(x);
  const double left = x - whole - width / 2, right = x - whole + width / 2;
  // Antiderivative of the pattern that is 1 on [0,1): the distance to the nearest even integer.
  const auto area = [](double t) { return std::abs(t - 2 * std::nearbyint(t / 2)); };
  const double mean = (area(right) - area(left)) / width;
  return is_even(whole) ? mean : -mean;
}

/// x mapped to [0,1]: x - floor(x), clamped, or mirrored at every integer.
inline double wrapped(Texture::Wrap wrap, double x) {
  switch (wrap) {
    case Texture::Wrap::repeat:
      return x - std::floor(x);
    case Texture::Wrap::clamp:
      return std::clamp(x, 0.0, 1.0);
    case Texture::Wrap::mirror:
      return std::abs(x - 2 * std::nearbyint(x / 2));
  }
  return x;
}

namespace box_filter_detail {

inline double repeat_mean(double left, double right, double width) {
  const auto area = [](double t) {
    const double whole = std::floor(t), part = t - whole;
    return whole == -1 ? t + t * t / 2 : whole / 2 + part * part / 2;  // on [-1,0) without cancellation
  };
  return (area(right) - area(left)) / width;
}

inline double mirror_mean(double left, double right, double width, bool even) {
  const auto area = [](double t) {
    const double turns = std::nearbyint(t / 2), rest = t - 2 * turns;
    return turns + std::copysign(rest * rest / 2, rest);
  };
  const double mean = (area(right) - area(left)) / width;
  return even ? mean : 1 - mean;
}

/// By symmetry, values near 1 are computed from the side of 0, without cancellation.
inline double clamp_mean(double x, double width) {
  if (x > 0.5) return 1 - clamp_mean(1 - x, width);
  const auto area = [](double t) { return t < 0 ? 0 : t < 1 ? t * t / 2 : t - 0.5; };
  return (area(x + width / 2) - area(x - width / 2)) / width;
}

}  // namespace box_filter_detail

/// Mean of wrapped(wrap, t) over [x - width/2, x + width/2].
inline double wrapped_mean(Texture::Wrap wrap, double x, double width) {
  const double left = x - width / 2, right = x + width / 2;
  // Linear between integers: the mean is the value at the center.
  if (!(width > 0) || std::floor(left) == std::floor(right)) return wrapped(wrap, x);
  const double whole = std::nearbyint(x), part = x - whole;
  switch (wrap) {
    case Texture::Wrap::repeat:
      return box_filter_detail::repeat_mean(part - width / 2, part + width / 2, width);
    case Texture::Wrap::clamp:
      return std::clamp(box_filter_detail::clamp_mean(x, width), 0.0, 1.0);
    case Texture::Wrap::mirror:
      return box_filter_detail::mirror_mean(part - width / 2, part + width / 2, width, is_even(whole));
  }
  return 0;
}

}  // namespace tracer
