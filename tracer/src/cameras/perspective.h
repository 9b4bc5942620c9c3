#pragma once
/// The pinhole camera.

#include <numbers>

#include "tracer/src/math/vec.h"

namespace tracer {

class PerspectiveCamera {
 public:
  /// `position` is in the frame the rays are wanted in; directions need no frame.
  PerspectiveCamera(const Camera& camera, const ImageSize& image, const Vec3& position) : position_(position) {
    forward_ = normalize(camera.look_at - camera.position);
    right_ = normalize(cross(forward_, normalize(camera.up)));
    up_ = cross(right_, forward_);
    const double half_height = std::tan(camera.fov_deg * (std::numbers::pi / 360));
    pixel_ = 2 * half_height / image.height;
    left_ = -0.5 * image.width;
    top_ = 0.5 * image.height;
  }

  [[nodiscard]] const Vec3& position() const { return position_; }

  /// Unit direction through the image position (x, y), in pixels from the upper left corner.
  [[nodiscard]] Vec3 direction(double x, double y) const {
    return unit(forward_ + right_ * ((left_ + x) * pixel_) + up_ * ((top_ - y) * pixel_));
  }

  /// Width of a pixel seen along unit `direction`, per unit of distance.
  [[nodiscard]] double pixel_angle(const Vec3& direction) const { return pixel_ * dot(direction, forward_); }

 private:
  Vec3 position_, forward_, right_, up_;
  double pixel_ = 0, left_ = 0, top_ = 0;
};

}  // namespace tracer
