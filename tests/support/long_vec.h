#pragma once
/// Vectors in long double for the reference implementations, independent of the tracer's, and
/// camera rays.

#include <cmath>
#include <numbers>

#include "tracer/scene.h"

namespace oracle {

using Real = long double;

struct Vec {
  Real x = 0, y = 0, z = 0;
  Vec() = default;
  Vec(Real vx, Real vy, Real vz) : x(vx), y(vy), z(vz) {}
  Vec(const tracer::Vec3& v) : x(v.x), y(v.y), z(v.z) {}  // NOLINT(google-explicit-constructor): exact
};

inline Vec operator+(const Vec& a, const Vec& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec operator-(const Vec& a, const Vec& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec operator-(const Vec& a) { return {-a.x, -a.y, -a.z}; }
inline Vec operator*(Real s, const Vec& a) { return {s * a.x, s * a.y, s * a.z}; }
inline Real dot(const Vec& a, const Vec& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec cross(const Vec& a, const Vec& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Real length(const Vec& a) { return std::sqrt(dot(a, a)); }
inline Vec unit(const Vec& a) { return (1 / length(a)) * a; }
inline tracer::Vec3 rounded(const Vec& a) {
  return {static_cast<double>(a.x), static_cast<double>(a.y), static_cast<double>(a.z)};
}

/// Linear RGB.
struct Light3 {
  Real r = 0, g = 0, b = 0;
  Light3() = default;
  Light3(Real red, Real green, Real blue) : r(red), g(green), b(blue) {}
  Light3(const tracer::Color& c) : r(c.r), g(c.g), b(c.b) {}  // NOLINT(google-explicit-constructor): exact
};

inline Light3 operator+(const Light3& a, const Light3& b) { return {a.r + b.r, a.g + b.g, a.b + b.b}; }
inline Light3 operator*(const Light3& a, const Light3& b) { return {a.r * b.r, a.g * b.g, a.b * b.b}; }
inline Light3 operator*(Real s, const Light3& a) { return {s * a.r, s * a.g, s * a.b}; }
inline Real largest(const Light3& a) { return std::fmax(a.r, std::fmax(a.g, a.b)); }

/// Unit direction through the center of pixel (x, y) of a square image of a pinhole camera.
inline Vec through(const tracer::Scene& scene, std::uint32_t x, std::uint32_t y) {
  const tracer::Camera& camera = scene.camera;
  const Vec forward = unit(Vec(camera.look_at) - Vec(camera.position)), right = unit(cross(forward, camera.up));
  const Real half = std::tan(camera.fov_deg * std::numbers::pi_v<Real> / 360), side = scene.image.height;
  return unit(forward + (half * ((2 * x + 1) / side - 1)) * right +
              (half * (1 - (2 * y + 1) / side)) * cross(right, forward));
}

}  // namespace oracle
