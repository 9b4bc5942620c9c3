#pragma once
/// Camera ray of a pixel, in long double.

#include <numbers>

#include "tests/support/long_vec.h"

namespace oracle {

/// Unit direction through the center of pixel (x, y) of a square image of a pinhole camera.
inline Vec through(const tracer::Scene& scene, std::uint32_t x, std::uint32_t y) {
  const tracer::Camera& camera = scene.camera;
  const Vec forward = unit(Vec(camera.look_at) - Vec(camera.position)), right = unit(cross(forward, camera.up));
  const Real half = std::tan(camera.fov_deg * std::numbers::pi_v<Real> / 360), side = scene.image.height;
  return unit(forward + (half * ((2 * x + 1) / side - 1)) * right +
              (half * (1 - (2 * y + 1) / side)) * cross(right, forward));
}

}  // namespace oracle
