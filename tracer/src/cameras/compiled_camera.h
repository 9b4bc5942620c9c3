#pragma once
/// Camera in render space: generates rays and projects points.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>

#include "tracer/src/math/vec.h"
#include "tracer/src/scene/render_space.h"

namespace tracer {

class CompiledCamera {
 public:
  struct CameraRay {
    Vec3 origin, direction;  ///< render space; unit direction
  };

  CompiledCamera(const Camera& camera, const ImageSize& image, const RenderSpace& frame)
      : type_(camera.type),
        layout_(camera.layout),
        columns_(camera.layout == Camera::Layout::side_by_side ? image.width / 2 : image.width) {
    forward_ = normalize(camera.look_at - camera.position);
    right_ = normalize(cross(forward_, normalize(camera.up)));
    up_ = cross(right_, forward_);
    left_ = -0.5 * columns_;
    top_ = 0.5 * image.height;
    if (type_ == Camera::Type::perspective) {
      pixel_ = 2 * std::tan(camera.fov_deg * (std::numbers::pi / 360)) / image.height;
    } else if (type_ == Camera::Type::orthographic) {
      pixel_ = frame.render_from_world(camera.height) / image.height;
    } else {
      longitude_ = 2 * std::numbers::pi / image.width;
      latitude_ = std::numbers::pi / image.height;
    }
    lens_radius_ = frame.render_from_world(camera.aperture) / 2;
    focus_distance_ = frame.render_from_world(camera.focus_distance ? *camera.focus_distance
                                                                    : length(camera.look_at - camera.position));
    set_eyes(frame.render_from_world(camera.position), frame.render_from_world(camera.eye_separation) / 2);
  }

  [[nodiscard]] bool has_parallel_rays() const { return type_ == Camera::Type::orthographic; }

  /// Number of images of the scene: 2 for a stereo pair, the left one first.
  [[nodiscard]] std::size_t eyes() const { return layout_ == Camera::Layout::single ? 1 : 2; }
  [[nodiscard]] const Vec3& position(std::size_t eye = 0) const { return eyes_[eye].position; }
  /// True if each eye has its own channels: `eye` selects it below. Otherwise the column x does, and `eye` is ignored.
  [[nodiscard]] bool is_anaglyph() const { return layout_ == Camera::Layout::anaglyph; }
  /// Columns of one image; two images are beside each other unless is_anaglyph().
  [[nodiscard]] std::uint32_t columns() const { return columns_; }

  /// The ray through the image position (x, y), in pixels of the full image from its upper left corner, and the center
  /// of the lens.
  [[nodiscard]] CameraRay generate_ray(double x, double y, std::size_t eye = 0) const {
    const auto [position, axis, shear, left] = eye_at(x, eye);
    const double across = left + x, above = top_ - y;
    switch (type_) {
      case Camera::Type::perspective:
        return {position, unit(axis + right_ * (across * pixel_) + up_ * (above * pixel_))};
      case Camera::Type::orthographic:
        return {position + right_ * (across * pixel_) + up_ * (above * pixel_), axis};
      case Camera::Type::panorama:
        break;
    }
    const double longitude = across * longitude_, latitude = above * latitude_;
    const Vec3 level = forward_ * std::cos(longitude) + right_ * std::sin(longitude);
    return {position, unit(level * std::cos(latitude) + up_ * std::sin(latitude))};
  }

  /// Output of generate_rays, one array per component.
  struct CameraRaySpan {
    double *ox, *oy, *oz, *dx, *dy, *dz;
    void put(std::size_t i, const CameraRay& generate_ray) const {
      ox[i] = generate_ray.origin.x;
      oy[i] = generate_ray.origin.y;
      oz[i] = generate_ray.origin.z;
      dx[i] = generate_ray.direction.x;
      dy[i] = generate_ray.direction.y;
      dz[i] = generate_ray.direction.z;
    }
    /// The elements from `first` on.
    [[nodiscard]] CameraRaySpan from(std::size_t first) const {
      return {ox + first, oy + first, oz + first, dx + first, dy + first, dz + first};
    }
  };
  /// generate_ray(x[i], y[i], eye) for `count` positions.
  void generate_rays(const double* x, const double* y, std::size_t count, const CameraRaySpan& to,
                     std::size_t eye = 0) const;

  /// The ray through the point of the lens given by `xi` in [0,1)^2; (1/2, 1/2) is its center. All rays of an image
  /// position intersect at the focus of the ray through the center.
  [[nodiscard]] CameraRay generate_ray(double x, double y, const Vec2& xi, std::size_t eye = 0) const {
    const CameraRay central = generate_ray(x, y, eye);
    Vec3 right = right_, up = up_;
    if (type_ == Camera::Type::panorama) {
      const double longitude = (left_ + x) * longitude_;
      right = right_ * std::cos(longitude) - forward_ * std::sin(longitude);
      up = cross(right, central.direction);
    }
    const Vec2 point = disc_from_square(xi);
    const Vec3 offset = right * (point.x * lens_radius_) + up * (point.y * lens_radius_);
    const Vec3 focus = central.direction * (focus_distance_ / depth(central.direction, 1));
    return {central.origin + offset, normalize(focus - offset)};
  }

  /// Rays as linear functions of the image position: origin + x origin_x + y origin_y, and directions alike, which are
  /// not unit.
  struct LinearRays {
    Vec3 origin, origin_x, origin_y;
    Vec3 direction, direction_x, direction_y;
  };
  /// Rays through the center of the lens. None for a panorama and for two eyes.
  [[nodiscard]] std::optional<LinearRays> linear_rays() const {
    if (type_ == Camera::Type::panorama || eyes() > 1) return std::nullopt;
    const auto& [position, axis, shear, left] = eyes_[0];
    const Vec3 right = right_ * pixel_, down = up_ * -pixel_, corner = right * left + up_ * (top_ * pixel_);
    if (type_ == Camera::Type::orthographic) return LinearRays{position + corner, right, down, axis, {}, {}};
    return LinearRays{position, {}, {}, axis + corner, right, down};
  }
  [[nodiscard]] const Vec3& forward() const { return forward_; }

  /// Projects a point in render space through the center of the lens to an image position of the eye as in
  /// generate_ray; nothing for points behind the camera, and positions outside of the image for others.
  [[nodiscard]] std::optional<Vec2> project(const Vec3& point, std::size_t eye = 0) const {
    const auto& [position, axis, shear, left] = eyes_[eye];
    const Vec3 offset = point - position;
    const double ahead = dot(offset, forward_), up = dot(offset, up_);
    const double right = dot(offset, right_) - ahead * shear;
    if (type_ == Camera::Type::panorama) {
      const double longitude = std::atan2(right, ahead), latitude = std::atan2(up, std::hypot(ahead, right));
      return Vec2{longitude / longitude_ - left_, top_ - latitude / latitude_};
    }
    if (!(ahead > 0)) return std::nullopt;
    const double side = type_ == Camera::Type::perspective ? pixel_ * ahead : pixel_;
    return Vec2{right / side - left, top_ - up / side};
  }

  /// False if the position is beside the image of the eye, in that of the other one.
  [[nodiscard]] bool is_in_image(const Vec2& position, std::size_t eye) const {
    return layout_ != Camera::Layout::side_by_side || (position.x < columns_) == (eye == 0);
  }

  /// Footprint of a pixel on a plane perpendicular to the unit `direction`: side of a square that starts with `width`
  /// (render space) and grows by `spread` per unit of distance. The longer side for a panorama, whose pixels are
  /// narrower near the poles.
  struct Footprint {
    double width = 0, spread = 0;
  };
  [[nodiscard]] Footprint pixel_footprint(const Vec3& direction) const {
    switch (type_) {
      case Camera::Type::perspective:
        return {0, pixel_ * dot(direction, forward_)};
      case Camera::Type::orthographic:
        return {pixel_, 0};
      case Camera::Type::panorama:
        break;
    }
    const double level = std::sqrt(std::max(0.0, 1 - dot(direction, up_) * dot(direction, up_)));
    return {0, std::max(latitude_, longitude_ * level)};
  }

  /// Distance along the viewing axis of the point at distance `t` along a camera ray; for a panorama `t` itself.
  [[nodiscard]] double depth(const Vec3& direction, double t) const {
    return type_ == Camera::Type::panorama ? t : t * dot(direction, forward_);
  }

 private:
  struct Eye {
    Vec3 position;
    Vec3 axis;         ///< through the middle of the window; unit for parallel rays, else 1 along the viewing axis
    double shear = 0;  ///< part of the axis to the right, if it is 1 along the viewing axis
    double left = 0;   ///< left edge of the image, in pixels from the middle of the eye's window
  };

  void set_eyes(const Vec3& position, double half_separation) {
    eyes_.fill({position, forward_, 0, left_});
    if (layout_ == Camera::Layout::single) return;
    for (const std::size_t eye : {0, 1}) {
      const double aside = eye == 0 ? -half_separation : half_separation;
      Eye& at = eyes_[eye];
      at.shear = -aside / focus_distance_;
      at.position = position + right_ * aside;
      at.axis = forward_ + right_ * at.shear;
      if (type_ == Camera::Type::orthographic) at.axis = normalize(at.axis);
      if (eye == 1 && layout_ == Camera::Layout::side_by_side) at.left = left_ - columns_;
    }
  }

  [[nodiscard]] const Eye& eye_at(double x, std::size_t eye) const {
    return eyes_[layout_ == Camera::Layout::side_by_side ? (x < columns_ ? 0 : 1) : eye];
  }

  /// Concentric mapping: preserves relative areas and adjacency (Shirley & Chiu 1997, "A low distortion map between
  /// disk and square").
  static Vec2 disc_from_square(const Vec2& xi) {
    const double a = 2 * xi.x - 1, b = 2 * xi.y - 1;
    if (a == 0 && b == 0) return {};
    const bool wide = std::abs(a) > std::abs(b);
    const double radius = wide ? a : b;
    const double eighth = std::numbers::pi / 4;
    const double angle = wide ? eighth * (b / a) : 2 * eighth - eighth * (a / b);
    return {radius * std::cos(angle), radius * std::sin(angle)};
  }

  Camera::Type type_;
  Camera::Layout layout_;
  std::uint32_t columns_;
  Vec3 forward_, right_, up_;
  std::array<Eye, 2> eyes_;              ///< equal unless there are two
  double left_ = 0, top_ = 0;            ///< upper left corner in pixels from the image center
  double pixel_ = 0;                     ///< side of a pixel: perspective, at distance 1; orthographic, render space
  double longitude_ = 0, latitude_ = 0;  ///< panorama: radians a pixel
  double lens_radius_ = 0, focus_distance_ = 0;  ///< render space
};

}  // namespace tracer
