#include "tracer/src/sampling/subpixel_features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tracer/src/shapes/registry.h"

namespace tracer {
namespace {

/// A thing as a rod: from center - axis to center + axis, `radius` thick.
struct Capsule {
  Vec3 center, axis;
  double radius = 0;
};

Capsule rod(const Quadric& quadric) {
  const Linear& m = quadric.trace_from_shape;
  const Bounds box = local_box(quadric);
  const Vec3 extent = (box.high - box.low) * 0.5, middle = (box.low + box.high) * 0.5;
  std::array<Vec3, 3> half{m.x * extent.x, m.y * extent.y, m.z * extent.z};
  const Vec3 center = quadric.origin + m.x * middle.x + m.y * middle.y + m.z * middle.z;
  std::sort(half.begin(), half.end(), [](const Vec3& a, const Vec3& b) { return dot(a, a) > dot(b, b); });
  return {center, half[0], length(half[1])};
}

class Finder {
 public:
  Finder(const CompiledScene& scene, std::size_t most) : scene_(scene), window_(scene.image.window()), most_(most) {}

  void add(const Capsule& rod) {
    const double pixels = length(rod.axis) / pixel_side(rod.center);
    // A long rod is as thick on the image as where it is nearest: looked at step by step.
    const double longest = 2.0 * (scene_.image.width + scene_.image.height);
    const auto steps = static_cast<std::uint32_t>(std::clamp(std::ceil(2 * pixels), 1.0, longest));
    for (std::uint32_t step = 0; step < steps && found_.size() < most_; ++step) {
      const double along = (2 * step + 1.0) / steps - 1;
      add_place(rod.center + rod.axis * along, rod.radius, 2 * length(rod.axis) / steps);
    }
  }

  std::vector<SubpixelFeature> take() { return std::move(found_); }

 private:
  [[nodiscard]] double pixel_side(const Vec3& point) const {
    const Vec3 offset = point - scene_.camera.position();
    const CompiledCamera::Footprint footprint = scene_.camera.pixel_footprint(normalize(offset));
    return footprint.width + std::abs(footprint.spread) * length(offset);
  }

  void add_place(const Vec3& point, double radius, double length_of_step) {
    const double side = pixel_side(point);
    if (!(radius < side)) return;
    const auto seen = scene_.camera.seen_at(point);
    if (!seen) return;
    const double thick = radius / side;
    const double share = std::numbers::pi * thick * std::max(length_of_step / (2 * side), thick);
    if (thick < 0.1) return add_scout(*seen, share);
    // It reaches into other pixels: from the middle of each of its quarters.
    for (const double dx : {-0.5, 0.5})
      for (const double dy : {-0.5, 0.5}) add_scout({seen->x + dx * thick, seen->y + dy * thick}, share / 4);
  }

  void add_scout(const Vec2& seen, double share) {
    if (!(seen.x >= window_.x0 && seen.x < window_.x1 && seen.y >= window_.y0 && seen.y < window_.y1)) return;
    const double x = std::floor(seen.x), y = std::floor(seen.y);
    found_.push_back({static_cast<std::uint32_t>(x),
                      static_cast<std::uint32_t>(y),
                      {seen.x - x, seen.y - y},
                      static_cast<float>(std::min(share, 1.0))});
  }

  const CompiledScene& scene_;
  PixelWindow window_;
  std::size_t most_;
  std::vector<SubpixelFeature> found_;
};

}  // namespace

std::vector<SubpixelFeature> subpixel_features(const CompiledScene& scene, std::size_t most) {
  std::size_t things = 0;
  for (const SphereGeometry& spheres : scene.geometry().spheres) things += spheres.radius.size();
  for (const QuadricGeometry& quadrics : scene.geometry().quadrics) things += quadrics.quadrics.size();
  const std::size_t stride = things / std::max<std::size_t>(1, most) + 1;
  Finder finder(scene, most);
  for (const SphereGeometry& spheres : scene.geometry().spheres)
    for (std::size_t i = 0; i < spheres.radius.size(); i += stride)
      finder.add({{spheres.x[i], spheres.y[i], spheres.z[i]}, {}, spheres.radius[i]});
  for (const QuadricGeometry& quadrics : scene.geometry().quadrics)
    for (std::size_t i = 0; i < quadrics.quadrics.size(); i += stride) finder.add(rod(quadrics.quadrics[i]));
  return finder.take();
}

}  // namespace tracer
