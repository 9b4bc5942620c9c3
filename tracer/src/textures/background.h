#pragma once
/// What rays that hit nothing see.

#include <array>
#include <memory>
#include <vector>

#include "tracer/src/textures/texture.h"

namespace tracer {

class CompiledBackground {
 public:
  /// `images` beside `textures`; both may end before a background without textures.
  CompiledBackground(const Background& background, const Vec3& up, const std::vector<Texture>& textures,
                     const std::vector<std::shared_ptr<const ImageMap>>& images);

  /// `direction` is unit; `spread` is the angle, in radians, of what the ray's sample covers.
  [[nodiscard]] Color radiance(const Vec3& direction, double spread) const {
    if (kind_ == Kind::color) return color_;
    if (kind_ == Kind::gradient) {
      const double t = std::clamp((dot(direction, up_) + 1) / 2, 0.0, 1.0);
      return gradient_.nadir * (1 - t) + gradient_.zenith * t;
    }
    return kind_ == Kind::environment ? environment(direction, spread) : cube(direction, spread);
  }
  /// What every direction sees, or null.
  [[nodiscard]] const Color* plain() const { return kind_ == Kind::color ? &color_ : nullptr; }
  /// The largest channel that any direction can see.
  [[nodiscard]] double bound() const;

 private:
  enum class Kind { color, gradient, environment, cube };

  /// A texture as seen along an axis of the cube; or around the world, where the axis is straight ahead.
  struct Face {
    Vec3 axis, right, up;
    Texture texture;
    std::shared_ptr<const ImageMap> image;
    Wraps wraps;
  };

  [[nodiscard]] Color environment(const Vec3& direction, double spread) const;
  [[nodiscard]] Color cube(const Vec3& direction, double spread) const;

  Kind kind_ = Kind::color;
  Color color_;
  Gradient gradient_;
  Vec3 up_;
  std::vector<Face> faces_;  ///< one around the world, or six in the order of CubeMap
};

}  // namespace tracer
