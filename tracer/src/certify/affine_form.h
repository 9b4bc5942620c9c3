#pragma once
/// Affine arithmetic: rigorous ranges of functions of the position in a block of pixels.
///
/// The position is (s, t) in [-1, 1]^2, and a quantity is center + x s + y t + [-error, error]. Quantities that vary
/// together keep their dependence, so that the width of a result approaches the true one quadratically for small
/// blocks, where plain intervals of dependent quantities do not (Comba, Stolfi 1993, "Affine Arithmetic and its
/// Applications to Computer Graphics"; de Figueiredo, Stolfi 2004, "Affine Arithmetic: Concepts and Applications",
/// Numerical Algorithms 37).
///
/// Every operation adds a bound of its own rounding to `error`: the roundings of one operation are fewer than eight,
/// each relative to a term that `magnitude` bounds (Higham 2002, sec. 3.1). A form that overflows has the range of all
/// numbers. So does a function outside of its domain: comparisons with its range prove nothing.

#include <algorithm>
#include <cmath>
#include <limits>

#include "tracer/src/math/affine.h"
#include "tracer/src/math/rounding.h"
#include "tracer/src/math/vec.h"

namespace tracer {

struct Interval {
  double low = 0, high = 0;
  [[nodiscard]] bool contains(double value) const { return low <= value && value <= high; }
};

inline constexpr Interval all_numbers{-std::numeric_limits<double>::infinity(),
                                      std::numeric_limits<double>::infinity()};

/// Smallest interval that contains both.
inline Interval hull(const Interval& a, const Interval& b) {
  return {std::min(a.low, b.low), std::max(a.high, b.high)};
}

struct AffineForm {
  double center = 0, x = 0, y = 0, error = 0;

  [[nodiscard]] double radius() const { return std::abs(x) + std::abs(y) + error; }
  [[nodiscard]] double magnitude() const { return std::abs(center) + radius(); }
  [[nodiscard]] Interval range() const {
    const double reach = radius() * (1 + 0x1p-50) + std::abs(center) * 0x1p-51;
    const double low = center - reach, high = center + reach;
    return reach < std::numeric_limits<double>::max() && high - low >= 0 ? Interval{low, high} : all_numbers;
  }
};

/// Bound of the roundings of one operation, relative to the magnitudes of its terms.
inline constexpr double form_rounding = rounding_bound(8);

inline AffineForm unknown_form() { return {0, 0, 0, std::numeric_limits<double>::infinity()}; }
inline AffineForm exactly(double value) { return {value, 0, 0, 0}; }

/// A quantity of which only the interval is given.
inline AffineForm form_of(const Interval& interval) {
  const double center = 0.5 * interval.low + 0.5 * interval.high;
  const double half = std::max(interval.high - center, center - interval.low);
  return {center, 0, 0, half * (1 + 0x1p-50)};
}

inline AffineForm rounded(double center, double x, double y, double error, double magnitude) {
  return {center, x, y, error + (magnitude + error) * form_rounding};
}

inline AffineForm operator-(const AffineForm& a) { return {-a.center, -a.x, -a.y, a.error}; }
inline AffineForm operator+(const AffineForm& a, const AffineForm& b) {
  return rounded(a.center + b.center, a.x + b.x, a.y + b.y, a.error + b.error,
                 std::abs(a.center + b.center) + std::abs(a.x + b.x) + std::abs(a.y + b.y));
}
inline AffineForm operator-(const AffineForm& a, const AffineForm& b) { return a + -b; }
inline AffineForm operator+(const AffineForm& a, double b) {
  return rounded(a.center + b, a.x, a.y, a.error, std::abs(a.center + b));
}
inline AffineForm operator-(const AffineForm& a, double b) { return a + -b; }
inline AffineForm operator-(double a, const AffineForm& b) { return -b + a; }
inline AffineForm operator*(const AffineForm& a, double b) {
  return rounded(a.center * b, a.x * b, a.y * b, a.error * std::abs(b), a.magnitude() * std::abs(b));
}
inline AffineForm operator*(double a, const AffineForm& b) { return b * a; }

/// The product of the deviations from the centers is at most the product of the radii.
inline AffineForm operator*(const AffineForm& a, const AffineForm& b) {
  const double a_radius = a.radius(), b_radius = b.radius();
  const double a_size = std::abs(a.center), b_size = std::abs(b.center);
  return rounded(a.center * b.center, a.center * b.x + b.center * a.x, a.center * b.y + b.center * a.y,
                 a_size * b.error + b_size * a.error + a_radius * b_radius, (a_size + a_radius) * (b_size + b_radius));
}

/// The square of the deviation from the center lies between 0 and the square of the radius.
inline AffineForm squared(const AffineForm& a) {
  const double radius = a.radius(), size = std::abs(a.center), half = 0.5 * radius * radius;
  return rounded(a.center * a.center + half, 2 * a.center * a.x, 2 * a.center * a.y, 2 * size * a.error + half,
                 (size + radius) * (size + radius));
}

/// slope a + offset, with a further error of `deviation`.
inline AffineForm linear(const AffineForm& a, double slope, double offset, double deviation) {
  return rounded(slope * a.center + offset, slope * a.x, slope * a.y, std::abs(slope) * a.error + deviation,
                 2 * (std::abs(slope) * a.magnitude() + std::abs(offset)));
}

// Functions of one variable are replaced by the line with the smallest largest deviation over the range (Chebyshev):
// its slope is that of the secant, and its deviation is equal at both ends and at the tangent.

/// 1 / a for a range without 0.
inline AffineForm inverse(const AffineForm& a) {
  const auto [low, high] = a.range();
  if (!(low > 0) && !(high < 0)) return unknown_form();
  const double ends = 0.5 * (1 / low + 1 / high), tangent = std::copysign(1 / std::sqrt(low * high), low);
  return linear(a, -1 / (low * high), ends + tangent, std::abs(ends - tangent));
}

/// Square root; the part of the range below 0 does not occur.
inline AffineForm square_root(const AffineForm& a) {
  const Interval range = a.range();
  const double low = std::sqrt(std::max(0.0, range.low)), high = std::sqrt(std::max(0.0, range.high));
  const double sum = low + high;
  if (!(sum > 0)) return {};
  const double ends = low * high / sum, tangent = 0.25 * sum;
  return linear(a, 1 / sum, 0.5 * (ends + tangent), 0.5 * std::abs(tangent - ends));
}

// ---- vectors --------------------------------------------------------------------------------------------------------

struct AffineVec {
  AffineForm x, y, z;
};

inline AffineVec exactly(const Vec3& v) { return {exactly(v.x), exactly(v.y), exactly(v.z)}; }
inline Vec3 center(const AffineVec& v) { return {v.x.center, v.y.center, v.z.center}; }
inline Vec3 slope_x(const AffineVec& v) { return {v.x.x, v.y.x, v.z.x}; }
inline Vec3 slope_y(const AffineVec& v) { return {v.x.y, v.y.y, v.z.y}; }
inline double magnitude(const AffineVec& v) { return v.x.magnitude() + v.y.magnitude() + v.z.magnitude(); }

inline AffineVec operator-(const AffineVec& a) { return {-a.x, -a.y, -a.z}; }
inline AffineVec operator+(const AffineVec& a, const AffineVec& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline AffineVec operator-(const AffineVec& a, const AffineVec& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline AffineVec operator+(const AffineVec& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline AffineVec operator-(const AffineVec& a, const Vec3& b) { return a + -b; }
inline AffineVec operator*(const AffineVec& a, double b) { return {a.x * b, a.y * b, a.z * b}; }
inline AffineVec operator*(const AffineVec& a, const AffineForm& b) { return {a.x * b, a.y * b, a.z * b}; }
inline AffineVec operator*(const Vec3& a, const AffineForm& b) { return {a.x * b, a.y * b, a.z * b}; }

// Sums of three products: three times the roundings of one, added once.

inline AffineForm dot(const AffineVec& a, const Vec3& b) {
  const double x = std::abs(b.x), y = std::abs(b.y), z = std::abs(b.z);
  return rounded(a.x.center * b.x + a.y.center * b.y + a.z.center * b.z, a.x.x * b.x + a.y.x * b.y + a.z.x * b.z,
                 a.x.y * b.x + a.y.y * b.y + a.z.y * b.z, a.x.error * x + a.y.error * y + a.z.error * z,
                 3 * (a.x.magnitude() * x + a.y.magnitude() * y + a.z.magnitude() * z));
}
inline AffineForm dot(const AffineVec& a, const AffineVec& b) {
  const Vec3 u = center(a), v = center(b), p{a.x.radius(), a.y.radius(), a.z.radius()},
             q{b.x.radius(), b.y.radius(), b.z.radius()};
  const Vec3 size_u = abs(u), size_v = abs(v);
  const double error = dot(size_u, Vec3{b.x.error, b.y.error, b.z.error}) +
                       dot(size_v, Vec3{a.x.error, a.y.error, a.z.error}) + dot(p, q);
  return rounded(dot(u, v), dot(u, slope_x(b)) + dot(v, slope_x(a)), dot(u, slope_y(b)) + dot(v, slope_y(a)), error,
                 3 * dot(size_u + p, size_v + q));
}
inline AffineForm dot(const Vec3& a, const AffineVec& b) { return dot(b, a); }
/// Square of the length. As in squared(), the squares of the deviations lie between 0 and those of the radii.
inline AffineForm squared_length(const AffineVec& a) {
  const Vec3 c = center(a), size = abs(c), radius{a.x.radius(), a.y.radius(), a.z.radius()}, reach = size + radius;
  const double half = 0.5 * dot(radius, radius);
  return rounded(dot(c, c) + half, 2 * dot(c, slope_x(a)), 2 * dot(c, slope_y(a)),
                 2 * dot(size, Vec3{a.x.error, a.y.error, a.z.error}) + half, 3 * dot(reach, reach));
}
inline AffineVec cross(const AffineVec& a, const AffineVec& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline AffineVec operator*(const Linear& m, const AffineVec& v) {
  return {dot(v, Vec3{m.x.x, m.y.x, m.z.x}), dot(v, Vec3{m.x.y, m.y.y, m.z.y}), dot(v, Vec3{m.x.z, m.y.z, m.z.z})};
}

/// `a` at unit length, or unknown if it may be zero.
inline AffineVec normalized(const AffineVec& a) { return a * inverse(square_root(squared_length(a))); }

/// `a` with a further error of `error` along each axis.
inline AffineVec widened(AffineVec a, double error) {
  for (AffineForm* form : {&a.x, &a.y, &a.z}) form->error += error;
  return a;
}
/// The same with an error per axis.
inline AffineVec widened(AffineVec a, const Vec3& error) {
  a.x.error += error.x;
  a.y.error += error.y;
  a.z.error += error.z;
  return a;
}

}  // namespace tracer
