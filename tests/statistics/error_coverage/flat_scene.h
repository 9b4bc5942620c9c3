#pragma once
/// Flat scenes whose converged image has a closed form: emissive convex polygons in front of a ground whose radiance is
/// linear in y, seen by an orthographic camera. The box filter of a pixel is the exact area of the polygon
/// clipped to the pixel (Sutherland & Hodgman 1974).

#include <functional>
#include <vector>

#include "tracer/image.h"
#include "tracer/scene.h"

namespace error_coverage {

/// Size of an image in pixels.
struct Canvas {
  std::uint32_t width = 160, height = 120;
  bool operator==(const Canvas&) const = default;
};

/// Vertices in pixels: x to the right, y up, the origin at the image's center. Counter-clockwise.
using Polygon = std::vector<tracer::Vec2>;

Polygon rectangle(const tracer::Vec2& center, double width, double height, double angle = 0);
/// Regular polygon of `corners`, with the area of the circle of `radius`.
Polygon disc(const tracer::Vec2& center, double radius, int corners = 64);
/// The part of the image that is on the left of a line through `place` at this angle.
Polygon half_plane_from(Canvas canvas, const tracer::Vec2& place, double angle);

/// Image of a radiance by the centers of its pixels, in the coordinates of polygons.
tracer::Image image_of(Canvas canvas, const std::function<tracer::Color(double x, double y)>& radiance);

/// Radiance that is linear in y: `center` + y `along_y`, components may be negative.
struct LinearRadiance {
  tracer::Color center{}, along_y{};
  [[nodiscard]] tracer::Color at(const tracer::Vec2& position) const;
};

/// Linear radiance averaged over each pixel.
class BoxFilteredImage {
 public:
  BoxFilteredImage(Canvas canvas, const LinearRadiance& ground);
  /// Replaces the ground inside `polygon`, which must be convex and must not overlap another one.
  void replace(const Polygon& polygon, const tracer::Color& radiance);
  [[nodiscard]] tracer::Image image(double factor = 1) const;

 private:
  void add(std::uint32_t x, std::uint32_t y, const tracer::Color& radiance, double weight);
  Canvas canvas_;
  LinearRadiance ground_;
  std::vector<double> rgb_;
};

/// A scene for the tracer and its exact image, built together. One world unit is one pixel; the camera looks along -z.
class FlatScene {
 public:
  /// Path from the camera to the polygons: straight, by a plane mirror (reflectance 0.9), or through a slab of glass
  /// (two surfaces of transmittance 0.9, without Fresnel).
  enum class View { direct, mirror, glass };

  explicit FlatScene(Canvas canvas, const tracer::Color& ground, View view = View::direct);
  /// The same with a ground that changes from bottom to top; direct view only.
  FlatScene(Canvas canvas, const tracer::Color& bottom, const tracer::Color& top);

  /// An emissive polygon: a fan of triangles. It must not overlap another one.
  void add(const Polygon& polygon, const tracer::Color& radiance);
  /// An emissive cylinder without caps, seen as a rectangle; direct view only.
  void add_wire(const tracer::Vec2& from, const tracer::Vec2& to, double width, const tracer::Color& radiance);

  tracer::Scene& scene() { return scene_; }
  [[nodiscard]] tracer::Image exact_image() const { return image_.image(factor_); }

 private:
  [[nodiscard]] tracer::Vec3 world(const tracer::Vec2& position) const;
  Canvas canvas_;
  View view_ = View::direct;
  double factor_ = 1;
  tracer::Scene scene_;
  BoxFilteredImage image_;
};

/// Orthographic camera of FlatScene over an otherwise empty scene.
tracer::Scene orthographic_scene(Canvas canvas);
/// Adds a plane that fills the image; its color is `texture`, the first one of the scene. Returns its material.
tracer::Material& add_textured_plane(tracer::Scene& scene, const tracer::Texture& texture, double z = 0);

/// Image of a checker of unit cells scaled by `cell` pixels and moved by `offset` cells: the product of two square
/// waves, integrated over each pixel.
tracer::Image checker_image(Canvas canvas, double cell, const tracer::Vec2& offset, const tracer::Color& even,
                            const tracer::Color& odd);

}  // namespace error_coverage
