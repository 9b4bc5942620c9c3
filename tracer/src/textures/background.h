#pragma once
/// What rays that hit nothing see.

#include "tracer/src/math/vec.h"

namespace tracer {

class TraceBackground {
 public:
  TraceBackground(const Background& background, const Vec3& up)
      : color_(background.color), has_gradient_(background.gradient.has_value()) {
    if (!has_gradient_) return;
    gradient_ = *background.gradient;
    up_ = normalize(up);
  }

  /// `direction` is unit.
  [[nodiscard]] Color radiance(const Vec3& direction) const {
    if (!has_gradient_) return color_;
    const double t = std::clamp((dot(direction, up_) + 1) / 2, 0.0, 1.0);
    return gradient_.nadir * (1 - t) + gradient_.zenith * t;
  }

 private:
  Color color_;
  bool has_gradient_;
  Gradient gradient_;
  Vec3 up_;
};

}  // namespace tracer
