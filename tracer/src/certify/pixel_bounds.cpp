#include "tracer/src/certify/pixel_bounds.h"

#include <bit>
#include <optional>

#include "tracer/src/certify/scene_bounds.h"
#include "tracer/src/certify/shading_range.h"
#include "tracer/src/integrators/tracer_concept.h"

namespace tracer {
namespace {

constexpr std::uint32_t tile_side = 32;

float rounded_down(double value) {
  const auto rounded = static_cast<float>(value);
  return rounded > value ? std::nextafter(rounded, -HUGE_VALF) : rounded;
}
float rounded_up(double value) {
  const auto rounded = static_cast<float>(value);
  return rounded < value ? std::nextafter(rounded, HUGE_VALF) : rounded;
}

RadianceInterval rounded_outward(const ColorInterval& radiance, bool edge) {
  RadianceInterval interval;
  for (std::size_t c = 0; c < 3; ++c) {
    interval.low[c] = rounded_down(radiance[c].low);
    interval.high[c] = rounded_up(radiance[c].high);
  }
  interval.edge = edge;
  return interval;
}

/// S I + (1 - S) color for S in `scale`: linear in S and in I.
ColorInterval with_depth_cue(const DepthCue& cue, const Interval& scale, const ColorInterval& radiance) {
  const std::array<double, 3> color{cue.color.r, cue.color.g, cue.color.b};
  ColorInterval result;
  for (std::size_t c = 0; c < 3; ++c) {
    const auto mixed = [&](double s) {
      const auto at = [&](double value) { return (s > 0 ? s * value : 0) + (1 - s) * color[c]; };
      return Interval{at(radiance[c].low), at(radiance[c].high)};
    };
    const Interval range = hull(mixed(scale.low), mixed(scale.high));
    result[c] = {range.low * (1 - 0x1p-40), range.high * (1 + 0x1p-40)};
  }
  return result;
}

/// Bounds that all tiles share.
struct ImageBounds {
  ImageBounds(const CompiledScene& compiled, const RenderControl& control) : bounds(compiled, control) {
    rays = compiled.camera.linear_rays();
    if (compiled.needs.lens) rays.reset();
    for (std::uint32_t material = 0; material < compiled.materials.size(); ++material)
      materials.push_back(with_secondary_rays(bounds, material, local_radiance(bounds, material, 0)));
  }

  SceneBounds bounds;
  std::optional<CompiledCamera::LinearRays> rays;  ///< none: all rays are bounded alike
  std::vector<ColorInterval> materials;            ///< radiance of any of their points, by material
};

/// Pixels [x0, x1) x [y0, y1) of the full image.
struct PixelBlock {
  std::uint32_t x0, y0, x1, y1;
};

/// Bounds of the pixels of tiles, one after another.
class TileBounds {
 public:
  TileBounds(const ImageBounds& image, std::vector<RadianceInterval>& pixels)
      : image_(image), bounds_(image.bounds), scene_(image.bounds.scene), pixels_(pixels) {}

  void run(const PixelBlock& tile) {
    if (!image_.rays) {
      fill(tile, rounded_outward(finished(bounds_.any_radiance(), whole_cue(), true), true));
      return;
    }
    std::vector<Entry>& all = entries_[0];
    all.clear();
    for (std::uint32_t k = 0; k < scene_.geometry().planes.point.size(); ++k) all.push_back(plane_bit | k);
    if (!bounds_.tree.empty())
      for (std::uint32_t lane = 0; lane < bounds_.tree.node(0).count; ++lane) all.push_back(lane);
    divide(tile, tile_side, 1);
  }

 private:
  /// A lane of a node, as node * 8 + lane; or a plane.
  using Entry = std::uint32_t;
  static constexpr Entry plane_bit = 0x80000000u;
  static constexpr std::size_t entries_max = 64;  ///< nodes are opened while there are fewer
  static constexpr std::size_t levels = 8;

  struct Cover {
    Entry entry;
    PrimitiveRef primitive;
    BundleHit hit;
    AffineVec position;
    double depth = 0, depth_max = 0;  ///< along the bundle's axis, from the render space's origin
  };

  [[nodiscard]] bool is_plane(Entry entry) const { return (entry & plane_bit) != 0; }
  [[nodiscard]] const BoxTree::Node& node_of(Entry entry) const { return bounds_.tree.node(entry / BoxTree::width); }
  [[nodiscard]] bool is_primitive(Entry entry) const { return is_plane(entry) || node_of(entry).leaf; }
  [[nodiscard]] std::uint32_t child_of(Entry entry) const { return node_of(entry).child[entry % BoxTree::width]; }
  [[nodiscard]] PrimitiveRef primitive_of(Entry entry) const {
    if (is_plane(entry)) return {scene_.geometry().plane_geometry(), entry & ~plane_bit};
    return bounds_.tree.primitive(child_of(entry));
  }

  /// Bounds the pixels of a square of `side` pixels; `entries_[level - 1]` contains everything in it.
  void divide(const PixelBlock& block, std::uint32_t side, std::size_t level) {
    const Block positions{static_cast<double>(block.x0), static_cast<double>(block.y0), static_cast<double>(block.x1),
                          static_cast<double>(block.y1)};
    const CameraBundle bundle(*image_.rays, positions, bounds_.tree.reach());
    gather(bundle, level);
    const std::optional<Cover> cover = find_cover(bundle, entries_[level]);
    std::vector<Entry>& entries = entries_[level];
    const bool smooth = entries.empty();
    if (side == 1 || (smooth && side <= whole_side_max)) {
      const ColorInterval radiance = bound(bundle, cover, entries);
      if (side == 1 || is_narrow(radiance)) {
        fill(block, rounded_outward(radiance, !smooth));
        return;
      }
    }
    if (cover) entries.push_back(cover->entry);
    const std::uint32_t half = side / 2;
    for (std::uint32_t y = block.y0; y < block.y1; y += half)
      for (std::uint32_t x = block.x0; x < block.x1; x += half)
        divide({x, y, std::min(x + half, block.x1), std::min(y + half, block.y1)}, half, level + 1);
  }

  /// Blocks of this size or less are bounded as a whole if that is narrow.
  static constexpr std::uint32_t whole_side_max = 32;
  static bool is_narrow(const ColorInterval& radiance) {
    return std::all_of(radiance.begin(), radiance.end(),
                       [](const Interval& channel) { return channel.high - channel.low <= channel.high * 0x1p-10; });
  }

  /// Entries of the level below that overlap the bundle, with nodes opened.
  void gather(const CameraBundle& bundle, std::size_t level) {
    std::vector<Entry>& entries = entries_[level];
    entries.clear();
    for (const Entry entry : entries_[level - 1]) {
      const bool inside =
          is_plane(entry) || (overlaps(node_of(entry), bundle.region) >> (entry % BoxTree::width) & 1) != 0;
      if (inside) entries.push_back(entry);
    }
    for (std::size_t i = 0; i < entries.size();) {
      if (is_primitive(entries[i]) || entries.size() >= entries_max) {
        ++i;
        continue;
      }
      const std::uint32_t child = child_of(entries[i]);
      entries[i] = entries.back();
      entries.pop_back();
      for (unsigned mask = overlaps(bounds_.tree.node(child), bundle.region); mask != 0; mask &= mask - 1)
        entries.push_back(child * BoxTree::width + static_cast<std::uint32_t>(std::countr_zero(mask)));
    }
  }

  /// Removes the entries that no ray hits, or that are hidden by the nearest primitive that all rays hit. That one is
  /// returned and removed, too.
  std::optional<Cover> find_cover(const CameraBundle& bundle, std::vector<Entry>& entries) {
    std::optional<Cover> nearest;
    std::size_t kept = 0;
    for (const Entry entry : entries) {
      if (is_primitive(entry)) {
        const PrimitiveRef primitive = primitive_of(entry);
        const BundleHit hit = intersect(scene_.geometry(), primitive, bundle.rays);
        if (hit.kind == BundleHit::Kind::miss) continue;
        if (hit.kind == BundleHit::Kind::cover) consider(bundle, entry, primitive, hit, nearest);
      }
      entries[kept++] = entry;
    }
    entries.resize(kept);
    if (nearest)
      std::erase_if(entries,
                    [&](Entry entry) { return entry == nearest->entry || is_hidden(bundle, *nearest, entry); });
    return nearest;
  }

  void consider(const CameraBundle& bundle, Entry entry, const PrimitiveRef& primitive, const BundleHit& hit,
                std::optional<Cover>& nearest) const {
    const AffineVec along = bundle.rays.direction * hit.t;
    const AffineVec position =
        widened(bundle.rays.origin + along, (magnitude(bundle.rays.origin) + magnitude(along)) * 0x1p-45);
    const AffineForm depth = dot(position, bundle.axis);
    const Interval range = depth.range();
    if (nearest && !(depth.center < nearest->depth)) return;
    nearest = Cover{entry, primitive, hit, position, depth.center, range.high};
  }

  /// True if every ray hits the cover before it can hit the entry: the box of the entry is beyond all hits, or the
  /// segments to the hits stay on one side of a flat primitive.
  [[nodiscard]] bool is_hidden(const CameraBundle& bundle, const Cover& cover, Entry entry) const {
    if (!is_plane(entry) && bundle.forward) {
      const BoxTree::Node& node = node_of(entry);
      const std::size_t lane = entry % BoxTree::width;
      const Vec3& axis = bundle.axis;
      const double depth = axis.x * (axis.x > 0 ? node.low[0][lane] : node.high[0][lane]) +
                           axis.y * (axis.y > 0 ? node.low[1][lane] : node.high[1][lane]) +
                           axis.z * (axis.z > 0 ? node.low[2][lane] : node.high[2][lane]);
      if (depth - bounds_.tree.reach() * 0x1p-40 > cover.depth_max) return true;
    }
    return is_primitive(entry) &&
           on_one_side(scene_.geometry(), primitive_of(entry), bundle.rays.origin, cover.position);
  }

  /// Range of the radiance of a block that contains the cover, if any, and in front of it the entries.
  [[nodiscard]] ColorInterval bound(const CameraBundle& bundle, const std::optional<Cover>& cover,
                                    const std::vector<Entry>& entries) const {
    std::optional<ColorInterval> all;
    const auto include = [&](const ColorInterval& radiance) { all = all ? hull(*all, radiance) : radiance; };
    if (cover) include(covered(bundle, *cover));
    if (!cover) include(escaped(bundle));
    for (const Entry entry : entries) {
      const ColorInterval radiance =
          is_primitive(entry) ? image_.materials[material_of(primitive_of(entry))] : bounds_.any_radiance();
      include(finished(radiance, whole_cue(), false));
    }
    return *all;
  }

  [[nodiscard]] ColorInterval covered(const CameraBundle& bundle, const Cover& cover) const {
    const SurfacePatch patch = surface_patch(scene_, cover.primitive, bundle.rays, cover.hit);
    const AffineForm depth = dot(patch.hit - bundle.rays.origin, scene_.camera.forward());
    const bool perspective = is_black_vec(image_.rays->origin_x);
    const double width = image_.rays->pixel * (perspective ? depth.range().high : 1) * (1 + 0x1p-40);
    const ColorInterval radiance =
        with_secondary_rays(bounds_, patch.material, local_radiance(bounds_, patch, bundle.rays, width));
    if (!scene_.depth_cue) return finished(radiance, {}, false);
    const AffineForm world = depth * scene_.frame.world_from_render(1.0);
    const Interval range = world.range();
    const double slack = world.magnitude() * 0x1p-44;
    const DepthCue& cue = *scene_.depth_cue;
    const double first = depth_cue_scale(cue, range.low - slack), last = depth_cue_scale(cue, range.high + slack);
    return finished(radiance, {std::min(first, last), std::max(first, last)}, false);
  }

  static bool is_black_vec(const Vec3& v) { return v.x == 0 && v.y == 0 && v.z == 0; }

  /// Radiance of rays that hit nothing.
  [[nodiscard]] ColorInterval escaped(const CameraBundle& bundle) const {
    if (scene_.output.alpha) return {};  // transparent
    ColorInterval radiance = bounds_.background;
    if (const Gradient* const gradient = scene_.background->gradient()) {
      const AffineForm height = dot(normalized(bundle.rays.direction), scene_.background->up());
      const Interval range = height.range();
      const auto color = [&](double h) {
        const double t = std::clamp((h + 1) / 2, 0.0, 1.0);
        return interval_of(gradient->nadir * (1 - t) + gradient->zenith * t);
      };
      radiance = hull(color(range.low - 0x1p-44), color(range.high + 0x1p-44));
      for (Interval& channel : radiance) channel = {channel.low * (1 - 0x1p-40), channel.high * (1 + 0x1p-40)};
    }
    return finished(radiance, whole_cue_beyond(), false);
  }

  /// Ranges of the depth cue's scale: at any depth, and without a hit.
  [[nodiscard]] Interval whole_cue() const {
    if (!scene_.depth_cue) return {1, 1};
    const auto [low, high] = std::minmax(scene_.depth_cue->front_scale, scene_.depth_cue->back_scale);
    return {low, high};
  }
  [[nodiscard]] Interval whole_cue_beyond() const {
    if (!scene_.depth_cue) return {1, 1};
    return {scene_.depth_cue->back_scale, scene_.depth_cue->back_scale};
  }

  /// Absorption around the camera, and the depth cue. `transparent`: the rays may also escape and count as black.
  [[nodiscard]] ColorInterval finished(ColorInterval radiance, const Interval& cue_scale, bool transparent) const {
    if (bounds_.in_medium)
      for (Interval& channel : radiance) channel.low = 0;
    if (scene_.depth_cue) radiance = with_depth_cue(*scene_.depth_cue, cue_scale, radiance);
    return transparent && scene_.output.alpha ? hull(radiance, ColorInterval{}) : radiance;
  }

  [[nodiscard]] std::uint32_t material_of(const PrimitiveRef& primitive) const {
    const GeometrySet& geometry = scene_.geometry();
    const auto [number, i] = primitive;
    switch (geometry.kind_of(number)) {
      case GeometryKind::spheres:
        return scene_.objects.material[geometry.spheres[number].object[i]];
      case GeometryKind::triangles:
        return scene_.objects.material[geometry.mesh(number).object_of(i)];
      case GeometryKind::quadrics:
        return scene_.objects.material[geometry.quadric_set(number).object[i]];
      case GeometryKind::planes:
        break;
    }
    return scene_.objects.material[geometry.planes.object[i]];
  }

  void fill(const PixelBlock& block, const RadianceInterval& interval) {
    const PixelWindow window = scene_.image.window();
    for (std::uint32_t y = block.y0; y < block.y1; ++y)
      for (std::uint32_t x = block.x0; x < block.x1; ++x)
        pixels_[static_cast<std::size_t>(y - window.y0) * window.width() + (x - window.x0)] = interval;
  }

  const ImageBounds& image_;
  const SceneBounds& bounds_;
  const CompiledScene& scene_;
  std::vector<RadianceInterval>& pixels_;
  std::array<std::vector<Entry>, levels> entries_;
};

}  // namespace

std::vector<RadianceInterval> bound_pixels(const CompiledScene& scene, const InParallel& in_parallel,
                                           const RenderControl& control) {
  const PixelWindow window = scene.image.window();
  if (control.cancelled()) return {};
  const ImageBounds image(scene, control);
  std::vector<RadianceInterval> pixels(static_cast<std::size_t>(window.pixels()));
  const std::uint64_t columns = (window.width() + tile_side - 1) / tile_side;
  const std::uint64_t rows = (window.height() + tile_side - 1) / tile_side;
  in_parallel(columns * rows, [&](std::uint64_t tile) {
    if (control.cancelled()) return;
    const auto x = window.x0 + static_cast<std::uint32_t>(tile % columns) * tile_side;
    const auto y = window.y0 + static_cast<std::uint32_t>(tile / columns) * tile_side;
    TileBounds(image, pixels).run({x, y, std::min(x + tile_side, window.x1), std::min(y + tile_side, window.y1)});
  });
  if (control.cancelled()) return {};
  return pixels;
}

}  // namespace tracer
