#include "tracer/src/certify/pixel_bounds.h"

#include <optional>

#include "tracer/src/certify/block_radiance.h"
#include "tracer/src/certify/occupancy.h"
#include "tracer/src/certify/shadow_range.h"
#include "tracer/src/math/rounding.h"

namespace tracer {
namespace {

constexpr std::uint32_t tile_side = 32;

RadianceInterval rounded_outward(const ColorInterval& radiance, bool edge) {
  RadianceInterval interval;
  for (std::size_t c = 0; c < 3; ++c) {
    interval.low[c] = rounded_down(radiance[c].low);
    interval.high[c] = rounded_up(radiance[c].high);
  }
  interval.edge = edge;
  return interval;
}

/// Pixels [x0, x1) x [y0, y1) of the full image.
struct PixelBlock {
  std::uint32_t x0, y0, x1, y1;
};

/// Bounds of the pixels of tiles, one after another.
class TileBounds {
 public:
  TileBounds(const BlockRadiance& radiance, std::vector<RadianceInterval>& pixels)
      : radiance_(radiance),
        bounds_(radiance.bounds()),
        scene_(bounds_.scene),
        occupancy_(bounds_),
        mirrors_(bounds_),
        pixels_(pixels) {
    for (std::vector<Occluders>& lights : occluders_) lights.resize(scene_.lights.size());
    visible_.resize(scene_.lights.size());
    dark_ = std::exp2(-5 - scene_.output.exposure);
  }

  void run(const PixelBlock& tile) {
    if (!radiance_.rays(0, 0)) {
      fill(tile, radiance_.anything(), true);
      return;
    }
    occupancy_.reset(entries_[0]);
    divide(tile, tile_side, 1);
  }

 private:
  using Entry = Occupancy::Entry;
  using Cover = Occupancy::Cover;
  static constexpr std::size_t entries_max = 64;
  static constexpr std::size_t levels = 7;  ///< the whole scene, then blocks of 32, 16, 8, 4, 2 and 1 pixels
  /// Small blocks with many primitives are not divided: few of their pixels would be narrow, and the pixels of a mesh
  /// whose triangles have the size of a pixel cost more to bound than to sample.
  static bool is_dense(std::uint32_t side, std::size_t entries) {
    return side == 8 ? entries > 24 : side <= 4 && entries > 8;
  }

  /// Precondition: they are linear.
  [[nodiscard]] CompiledCamera::LinearRays rays_of(const PixelBlock& block) const {
    return *radiance_.rays(0.5 * (block.x0 + block.x1), 0.5 * (block.y0 + block.y1));
  }

  static Block positions_of(const PixelBlock& block) {
    return {static_cast<double>(block.x0), static_cast<double>(block.y0), static_cast<double>(block.x1),
            static_cast<double>(block.y1)};
  }

  /// Calls part(quarter) for the quarters of a square of `side` pixels.
  template <class Part>
  static void for_each_quarter(const PixelBlock& block, std::uint32_t side, const Part& part) {
    const std::uint32_t half = side / 2;
    for (std::uint32_t y = block.y0; y < block.y1; y += half)
      for (std::uint32_t x = block.x0; x < block.x1; x += half)
        part(PixelBlock{x, y, std::min(x + half, block.x1), std::min(y + half, block.y1)});
  }

  /// Bounds the pixels of a square of `side` pixels; `entries_[level - 1]` contains everything in it.
  void divide(const PixelBlock& block, std::uint32_t side, std::size_t level) {
    const Beam beam(rays_of(block), positions_of(block), bounds_.tree.reach());
    std::vector<Entry>& entries = entries_[level];
    occupancy_.gather(entries_[level - 1], beam.region, entries_max, entries);
    const std::optional<Cover> cover = occupancy_.find_cover(beam, {}, entries);
    if (entries.empty() && !cover) return divide_background(block, side);
    if (entries.empty()) {
      for (Occluders& light : occluders_[level - 1]) light.state = Occluders::State::unknown;
      return divide_surface(block, side, level, cover->primitive, side);
    }
    if (cover) entries.push_back(cover->entry);
    if (side == 1 || is_dense(side, entries.size())) {
      fill(block, all_of(beam.rays, !cover, entries), true);
      return;
    }
    for_each_quarter(block, side, [&](const PixelBlock& quarter) { divide(quarter, side / 2, level + 1); });
  }

  void divide_background(const PixelBlock& block, std::uint32_t side) {
    const EscapedRays rays = radiance_.escaped(camera_rays(rays_of(block), positions_of(block)));
    const ColorInterval whole = radiance_.range(rays, {});
    if (is_narrow(whole)) {
      fill(block, whole, false);
    } else if (side <= forms_side_max) {
      fill_parts(block, [&](const BlockPart& part) { return radiance_.range(rays, part); });
    } else {
      for_each_quarter(block, side, [&](const PixelBlock& quarter) { divide_background(quarter, side / 2); });
    }
  }

  /// Bounds the pixels of a block that `primitive` covers alone. `occluders_[level - 1]` are those of a block around
  /// it; the radiance is not nearly linear over blocks of more than `linear_side` pixels.
  void divide_surface(const PixelBlock& block, std::uint32_t side, std::size_t level, const PrimitiveRef& primitive,
                      std::uint32_t linear_side) {
    const RayBundle rays = camera_rays(rays_of(block), positions_of(block));
    const BundleHit hit = intersect(scene_.geometry(), primitive, rays);
    if (hit.kind != BundleHit::Kind::cover) {  // rounding
      fill(block, radiance_.primitive(primitive), true);
      return;
    }
    const SurfacePatch patch = surface_patch(scene_, primitive, rays, hit, bounds_.approximate.shading);
    const bool certain = find_shadows(patch, side, level);
    if (side == 1 || (certain && side <= linear_side)) {
      SurfaceRays surface = radiance_.surface(patch, rays, visible_);
      double excess = surface.nonlinear_width(dark_, side) / narrow_width;
      if (side == 1 || excess <= 1) {
        surface.reflected = mirrors_.reflected(patch, rays);
        excess = surface.nonlinear_width(dark_, side) / narrow_width;
      }
      if (side == 1 || excess <= 1) {
        fill_parts(block, [&](const BlockPart& part) { return radiance_.range(surface, part); });
        return;
      }
      // The error of forms shrinks with the square of the side.
      linear_side = std::isfinite(excess) ? static_cast<std::uint32_t>(side / std::sqrt(excess)) : side / 2;
    }
    for_each_quarter(block, side, [&](const PixelBlock& quarter) {
      divide_surface(quarter, side / 2, level + 1, primitive, linear_side);
    });
  }

  /// Sets `visible_`. Returns true if every light is visible from the whole patch or from none of it.
  bool find_shadows(const SurfacePatch& patch, std::uint32_t side, std::size_t level) {
    bool certain = true;
    for (std::size_t light = 0; light < visible_.size(); ++light) {
      Occluders* const found = side > 1 ? &occluders_[level][light] : nullptr;
      const Interval visible = shadow_range(bounds_, patch, scene_.lights[light], occluders_[level - 1][light], found);
      visible_[light] = visible;
      certain &= visible.low == visible.high;
    }
    return certain;
  }

  /// Blocks in which the gradient of the background is nearly linear.
  static constexpr std::uint32_t forms_side_max = 8;
  /// Width of an interval, relative to its larger end, that needs no smaller blocks: a tenth of a level. The display
  /// curve is steeper than that in the dark only.
  static constexpr double narrow_width = 0x1p-10;
  static double relative_width(const ColorInterval& radiance) {
    double largest = 0;
    for (const Interval& channel : radiance)
      if (channel.high > channel.low) largest = std::max(largest, 1 - channel.low / channel.high);
    return largest;
  }
  static bool is_narrow(const ColorInterval& radiance) { return relative_width(radiance) <= narrow_width; }

  /// Range of all entries, and of the background where rays may escape.
  [[nodiscard]] ColorInterval all_of(const RayBundle& rays, bool may_escape, const std::vector<Entry>& entries) const {
    const auto range = [&](Entry entry) {
      return occupancy_.is_primitive(entry) ? radiance_.primitive(occupancy_.primitive_of(entry))
                                            : radiance_.anything();
    };
    ColorInterval all = may_escape ? radiance_.range(radiance_.escaped(rays), {}) : range(entries[0]);
    for (const Entry entry : entries) all = hull(all, range(entry));
    return all;
  }

  void fill(const PixelBlock& block, const ColorInterval& radiance, bool edge) {
    const RadianceInterval interval = rounded_outward(radiance, edge);
    const PixelWindow window = scene_.image.window();
    for (std::uint32_t y = block.y0; y < block.y1; ++y)
      for (std::uint32_t x = block.x0; x < block.x1; ++x)
        pixels_[static_cast<std::size_t>(y - window.y0) * window.width() + (x - window.x0)] = interval;
  }

  /// Fills each pixel of the block with the range over its part of the block.
  template <class Range>
  void fill_parts(const PixelBlock& block, const Range& range) {
    const double width = block.x1 - block.x0, height = block.y1 - block.y0;
    for (std::uint32_t y = block.y0; y < block.y1; ++y)
      for (std::uint32_t x = block.x0; x < block.x1; ++x) {
        // The sum of the rounding of these quotients is below that of one operation with a form.
        const BlockPart part{(2.0 * (x - block.x0) + 1) / width - 1, (2.0 * (y - block.y0) + 1) / height - 1, 1 / width,
                             1 / height};
        fill({x, y, x + 1, y + 1}, range(part), false);
      }
  }

  const BlockRadiance& radiance_;
  const SceneBounds& bounds_;
  const CompiledScene& scene_;
  Occupancy occupancy_;
  MirrorBeams mirrors_;
  std::vector<RadianceInterval>& pixels_;
  std::array<std::vector<Entry>, levels> entries_;
  std::array<std::vector<Occluders>, levels> occluders_;  ///< by light
  std::vector<Interval> visible_;                         ///< by light, from the patch being bounded
  double dark_;                                           ///< radiance below which widths count as if it were this
};

/// Bounds of the rays of one eye of an anaglyph, or of all rays.
std::vector<RadianceInterval> bound_eye(const CompiledScene& scene, const Approximations& approximate, std::size_t eye,
                                        const InParallel& in_parallel, const RenderControl& control) {
  const PixelWindow window = scene.image.window();
  const BlockRadiance radiance(scene, approximate, control, eye);
  std::vector<RadianceInterval> pixels(static_cast<std::size_t>(window.pixels()));
  // No tile has pixels of two images that are side by side. There is no crop then.
  const std::uint32_t width = std::min(window.width(), scene.camera.columns());
  const std::uint64_t columns = (width + tile_side - 1) / tile_side;
  const std::uint64_t rows = (window.height() + tile_side - 1) / tile_side;
  in_parallel(columns * rows * (window.width() / width), [&](std::uint64_t tile) {
    if (control.cancelled()) return;
    const auto left = window.x0 + static_cast<std::uint32_t>(tile / (columns * rows)) * width;
    const auto x = left + static_cast<std::uint32_t>(tile % columns) * tile_side;
    const auto y = window.y0 + static_cast<std::uint32_t>(tile / columns % rows) * tile_side;
    TileBounds(radiance, pixels).run({x, y, std::min(x + tile_side, left + width), std::min(y + tile_side, window.y1)});
  });
  return pixels;
}

}  // namespace

std::vector<RadianceInterval> bound_pixels(const CompiledScene& scene, const Approximations& approximate,
                                           const InParallel& in_parallel, const RenderControl& control) {
  if (control.cancelled()) return {};
  std::vector<RadianceInterval> pixels = bound_eye(scene, approximate, 0, in_parallel, control);
  if (scene.camera.is_anaglyph() && !control.cancelled()) {
    const std::vector<RadianceInterval> right = bound_eye(scene, approximate, 1, in_parallel, control);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      for (const std::size_t channel : {1, 2}) {
        pixels[i].low[channel] = right[i].low[channel];
        pixels[i].high[channel] = right[i].high[channel];
      }
      pixels[i].edge = pixels[i].edge || right[i].edge;
    }
  }
  if (control.cancelled()) return {};
  return pixels;
}

}  // namespace tracer
