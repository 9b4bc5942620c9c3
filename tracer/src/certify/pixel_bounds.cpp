#include "tracer/src/certify/pixel_bounds.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "tracer/src/accel/primitive_bounds.h"
#include "tracer/src/certify/shading_range.h"
#include "tracer/src/math/rounding.h"

namespace tracer {
namespace {

constexpr std::uint32_t tile_side = 32;

/// Pixels [x0, x1) x [y0, y1) of the full image.
struct PixelBlock {
  std::uint32_t x0, y0, x1, y1;
};

using Use = std::function<void(std::size_t, const RadianceInterval&)>;

/// Bounds of the pixels of tiles, one after another.
class TileBounds {
 public:
  TileBounds(const SceneBounds& bounds, const CompiledCamera::LinearRays& camera, const Use& use)
      : bounds_(bounds), scene_(bounds.scene), camera_(camera), use_(use), visible_(bounds.scene.lights.size()) {}

  /// The whole scene, at any pixel.
  void fill_with_any(const PixelBlock& block) const {
    ColorInterval any = bounds_.any_radiance();
    if (const auto& cue = scene_.depth_cue)
      any = hull(any, {{{0, cue->color.r}, {0, cue->color.g}, {0, cue->color.b}}});
    fill(block, any);
  }

  /// Bounds the pixels of a square of `side` pixels.
  void divide(const PixelBlock& block, std::uint32_t side) {
    const Beam beam(camera_, {static_cast<double>(block.x0), static_cast<double>(block.y0),
                              static_cast<double>(block.x1), static_cast<double>(block.y1)});
    const bool complete = gather(beam);
    if (side == 1 && !complete) return fill_with_any(block);
    const std::optional<Cover> cover = complete ? find_cover(beam) : std::nullopt;
    if (complete && primitives_.empty()) {
      const ColorInterval range = cover ? surface(beam, *cover) : background(beam.rays);
      if (side == 1 || is_narrow(range)) return fill(block, range);
    } else if (side == 1 || (complete && is_dense(side))) {
      return fill(block, all_of(beam, cover));
    }
    const std::uint32_t half = side / 2;
    for (std::uint32_t y = block.y0; y < block.y1; y += half)
      for (std::uint32_t x = block.x0; x < block.x1; x += half)
        divide({x, y, std::min(x + half, block.x1), std::min(y + half, block.y1)}, half);
  }

 private:
  /// A primitive that all rays hit.
  struct Cover {
    PrimitiveRef primitive;
    BundleHit hit;
    AffineVec position;
    double depth_max;  ///< along the beam's axis, from the render space's origin
  };

  static constexpr std::size_t primitives_max = 64;
  /// Small blocks with many primitives are not divided: few of their pixels would be narrow.
  [[nodiscard]] bool is_dense(std::uint32_t side) const {
    return side == 8 ? primitives_.size() > 24 : side <= 4 && primitives_.size() > 8;
  }

  /// Sets `primitives_` to those that the beam may hit. False if they are too many.
  bool gather(const Beam& beam) {
    const GeometrySet& geometry = scene_.geometry();
    primitives_.clear();
    for (std::uint32_t k = 0; k < geometry.planes.point.size(); ++k)
      primitives_.push_back({geometry.plane_geometry(), k});
    bounds_.tree.each(beam.region, [&](const PrimitiveRef& primitive) {
      primitives_.push_back(primitive);
      return primitives_.size() <= primitives_max;
    });
    return primitives_.size() <= primitives_max;
  }

  /// Removes the primitives that no ray hits, or that are hidden by the nearest one that all rays hit. That one is
  /// returned and removed, too.
  std::optional<Cover> find_cover(const Beam& beam) {
    std::optional<Cover> nearest;
    double nearest_depth = 0;
    std::erase_if(primitives_, [&](const PrimitiveRef& primitive) {
      const BundleHit hit = intersect(scene_.geometry(), primitive, beam.rays);
      if (hit.kind != BundleHit::Kind::cover) return hit.kind == BundleHit::Kind::miss;
      const AffineVec along = beam.rays.direction * hit.t;
      const double rounding = (magnitude(beam.rays.origin) + magnitude(along)) * 0x1p-45;
      const AffineVec position = widened(beam.rays.origin + along, rounding);
      const AffineForm depth = dot(position, beam.axis);
      if (nearest && !(depth.center < nearest_depth)) return false;
      nearest = {primitive, hit, position, depth.range().high};
      nearest_depth = depth.center;
      return false;
    });
    if (nearest)
      std::erase_if(primitives_, [&](const PrimitiveRef& primitive) {
        return primitive == nearest->primitive || is_hidden(beam, *nearest, primitive);
      });
    return nearest;
  }

  /// True if every ray hits the cover before it can hit the primitive: the box of that one is beyond all hits, or the
  /// segments to the hits stay on one side of it, and it is flat.
  [[nodiscard]] bool is_hidden(const Beam& beam, const Cover& cover, const PrimitiveRef& primitive) const {
    const Bounds box = bounds_of(scene_.geometry(), primitive);
    const Vec3& axis = beam.axis;
    if (!box.empty() && beam.forward) {
      const double depth = axis.x * (axis.x > 0 ? box.low.x : box.high.x) +
                           axis.y * (axis.y > 0 ? box.low.y : box.high.y) +
                           axis.z * (axis.z > 0 ? box.low.z : box.high.z);
      if (depth - bounds_.tree.reach() * 0x1p-40 > cover.depth_max) return true;
    }
    return on_one_side(scene_.geometry(), primitive, beam.rays.origin, cover.position);
  }

  [[nodiscard]] ColorInterval surface(const Beam& beam, const Cover& cover) {
    const SurfacePatch patch = surface_patch(bounds_, cover.primitive, beam.rays, cover.hit);
    for (std::size_t light = 0; light < visible_.size(); ++light)
      visible_[light] = shadow_range(bounds_, patch, scene_.lights[light]);
    return shading_range(bounds_, patch, beam.rays, visible_);
  }

  [[nodiscard]] ColorInterval background(const RayBundle& rays) const {
    const Gradient* const gradient = scene_.background->gradient();
    if (scene_.output.alpha || gradient == nullptr) return scene_.output.alpha ? ColorInterval{} : bounds_.background;
    const Interval height = dot(normalized(rays.direction), scene_.background->up()).range();
    const auto color = [&](double h) {
      const double t = std::clamp((h + 1) / 2, 0.0, 1.0);
      return interval_of(gradient->nadir * (1 - t) + gradient->zenith * t);
    };
    ColorInterval range = hull(color(height.low - 0x1p-44), color(height.high + 0x1p-44));
    for (Interval& channel : range) channel = {channel.low * (1 - 0x1p-40), channel.high * (1 + 0x1p-40)};
    return range;
  }

  /// Range of all primitives, and of the background where rays may escape.
  [[nodiscard]] ColorInterval all_of(const Beam& beam, const std::optional<Cover>& cover) const {
    const auto range = [&](const PrimitiveRef& primitive) {
      return bounds_.materials[scene_.objects.material[scene_.geometry().object_of(primitive)]].anywhere;
    };
    ColorInterval all = cover ? range(cover->primitive) : background(beam.rays);
    for (const PrimitiveRef& primitive : primitives_) all = hull(all, range(primitive));
    return all;
  }

  /// True if the interval is about two levels wide after display, for which the root stands here: smaller blocks would
  /// change little.
  [[nodiscard]] bool is_narrow(const ColorInterval& range) const {
    const double gain = std::exp2(scene_.output.exposure);
    return std::ranges::all_of(range, [&](const Interval& channel) {
      const auto shown = [&](double radiance) { return std::sqrt(std::min(1.0, radiance * gain)); };
      return 255 * (shown(channel.high) - shown(channel.low)) <= 2;
    });
  }

  void fill(const PixelBlock& block, const ColorInterval& radiance) const {
    RadianceInterval interval;
    for (std::size_t c = 0; c < 3; ++c) {
      interval.low[c] = bounds_.in_medium ? 0 : rounded_down(radiance[c].low);
      interval.high[c] = rounded_up(radiance[c].high);
    }
    const PixelWindow window = scene_.image.window();
    for (std::uint32_t y = block.y0; y < block.y1; ++y)
      for (std::uint32_t x = block.x0; x < block.x1; ++x)
        use_(static_cast<std::size_t>(y - window.y0) * window.width() + (x - window.x0), interval);
  }

  const SceneBounds& bounds_;
  const CompiledScene& scene_;
  const CompiledCamera::LinearRays& camera_;
  const Use& use_;
  std::vector<PrimitiveRef> primitives_;
  std::vector<Interval> visible_;  ///< by light, from the patch being bounded
};

}  // namespace

void bound_pixels(const CompiledScene& scene, const InParallel& in_parallel, const RenderControl& control,
                  const std::function<bool()>& hurry, const Use& use) {
  if (control.cancelled()) return;
  const SceneBounds bounds(scene, control);
  const PixelWindow window = scene.image.window();
  const auto rays = scene.camera.linear_rays();
  const bool follows = rays && !scene.needs.lens && !scene.depth_cue;
  const CompiledCamera::LinearRays camera = rays.value_or(CompiledCamera::LinearRays{});
  const std::uint64_t columns = (window.width() + tile_side - 1) / tile_side,
                      rows = (window.height() + tile_side - 1) / tile_side;
  in_parallel(columns * rows, [&](std::uint64_t tile) {
    if (control.cancelled()) return;
    const auto x = window.x0 + static_cast<std::uint32_t>(tile % columns) * tile_side,
               y = window.y0 + static_cast<std::uint32_t>(tile / columns) * tile_side;
    const PixelBlock block{x, y, std::min(x + tile_side, window.x1), std::min(y + tile_side, window.y1)};
    TileBounds pixels(bounds, camera, use);
    if (!follows || hurry()) return pixels.fill_with_any(block);
    pixels.divide(block, tile_side);
  });
}

}  // namespace tracer
