#pragma once
/// Background radiance, for rays that hit nothing.

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "tracer/src/textures/texture.h"

namespace tracer {

class CompiledBackground {
 public:
  enum class Kind { color, gradient, environment, cube };

  /// A texture on one face of the cube, or an environment, with the direction of its center as `axis`.
  struct Face {
    Vec3 axis, right, up;
    Texture texture;
    std::shared_ptr<const ImageMap> image;
    Wraps wraps;
  };

  /// `images[i]` belongs to `textures[i]`. Both may be empty if the background has no textures.
  CompiledBackground(const Background& background, const Vec3& up, const std::vector<Texture>& textures,
                     const std::vector<std::shared_ptr<const ImageMap>>& images);

  /// `direction` is unit; `spread` is the angular size of the sample's footprint, in radians.
  [[nodiscard]] Color radiance(const Vec3& direction, double spread) const {
    if (kind_ == Kind::color) return color_;
    if (kind_ == Kind::gradient) {
      const double t = std::clamp((dot(direction, up_) + 1) / 2, 0.0, 1.0);
      return gradient_.nadir * (1 - t) + gradient_.zenith * t;
    }
    return kind_ == Kind::environment ? environment(direction, spread) : cube(direction, spread);
  }
  /// Constant radiance of all directions, or null.
  [[nodiscard]] const Color* plain() const { return kind_ == Kind::color ? &color_ : nullptr; }
  /// Gradient along up(), or null.
  [[nodiscard]] const Gradient* gradient() const { return kind_ == Kind::gradient ? &gradient_ : nullptr; }
  [[nodiscard]] const Vec3& up() const { return up_; }
  [[nodiscard]] Kind kind() const { return kind_; }
  /// One for an environment, six in the order of CubeMap, or none.
  [[nodiscard]] const std::vector<Face>& faces() const { return faces_; }
  /// Directions at which the textures have their texels: `columns` around `up` from behind, turning to `right`, and
  /// `rows` of equal angles from below. Those of a cube are as close. No columns without textures.
  struct DirectionGrid {
    Vec3 ahead, right, up;
    double columns = 0, rows = 0;
  };
  [[nodiscard]] DirectionGrid grid() const;
  /// Unfiltered, at a point of the unit square over the grid. Precondition: it has columns.
  [[nodiscard]] Color radiance_at(const Vec2& uv) const;
  /// Texels that are side by side, as a disc.
  struct Spot {
    std::array<Vec3, 5> directions;  ///< towards its center, and close to its four corners; unit
    double radius = 0;               ///< radians
  };
  /// The brightest texels of an environment, such as the sun. None if they are less than 16 times as bright as the
  /// mean: samples find such light.
  [[nodiscard]] std::optional<Spot> brightest() const;
  /// Upper bound of the radiance over all directions and channels.
  [[nodiscard]] double bound() const;

 private:
  [[nodiscard]] Color environment(const Vec3& direction, double spread) const;
  [[nodiscard]] Color cube(const Vec3& direction, double spread) const;

  Kind kind_ = Kind::color;
  Color color_;
  Gradient gradient_;
  Vec3 up_;
  std::vector<Face> faces_;
};

}  // namespace tracer
