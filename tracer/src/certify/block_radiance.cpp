#include "tracer/src/certify/block_radiance.h"

#include "tracer/src/compiled/compiled_scene.h"

namespace tracer {
namespace {

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

ColorInterval with_reflected(ColorInterval local, const RadianceForms& reflected, const BlockPart& part) {
  for (std::size_t c = 0; c < 3; ++c) {
    const Interval added = restricted(reflected[c], part).range();
    local[c] = {(local[c].low + std::max(0.0, added.low)) * (1 - 0x1p-40),
                (local[c].high + added.high) * (1 + 0x1p-40)};
  }
  return local;
}

}  // namespace

double SurfaceRays::nonlinear_width(double dark, double side) const {
  double largest = local.nonlinear_width(dark, side);
  if (reflected)
    for (const AffineForm& channel : *reflected)
      largest = std::max(largest, 2 * channel.error / std::max(channel.range().high, dark));
  return largest;
}

BlockRadiance::BlockRadiance(const CompiledScene& compiled, const Approximations& approximate,
                             const RenderControl& control, std::size_t eye)
    : bounds_(compiled, approximate, control), scene_(compiled), eye_(eye) {
  rays_ = rays(0, 0).value_or(CompiledCamera::LinearRays{});
  for (std::uint32_t material = 0; material < compiled.materials.size(); ++material)
    materials_.push_back(with_secondary_rays(bounds_, material, local_radiance(bounds_, material, 0)));
}

EscapedRays BlockRadiance::escaped(const RayBundle& rays) const {
  if (scene_.output.alpha || scene_.background->gradient() == nullptr) return {};
  return {dot(normalized(rays.direction), scene_.background->up())};
}

ColorInterval BlockRadiance::range(const EscapedRays& rays, const BlockPart& part) const {
  if (scene_.output.alpha) return {};  // transparent
  ColorInterval radiance = bounds_.background;
  if (const Gradient* const gradient = scene_.background->gradient()) {
    const Interval height = restricted(rays.height, part).range();
    const auto color = [&](double h) {
      const double t = std::clamp((h + 1) / 2, 0.0, 1.0);
      return interval_of(gradient->nadir * (1 - t) + gradient->zenith * t);
    };
    radiance = hull(color(height.low - 0x1p-44), color(height.high + 0x1p-44));
    for (Interval& channel : radiance) channel = {channel.low * (1 - 0x1p-40), channel.high * (1 + 0x1p-40)};
  }
  const double beyond = scene_.depth_cue ? scene_.depth_cue->back_scale : 1;
  return finished(radiance, {beyond, beyond});
}

SurfaceRays BlockRadiance::surface(const SurfacePatch& patch, const RayBundle& rays,
                                   std::span<const Interval> visible) const {
  const AffineVec along = patch.hit - rays.origin;
  const bool panorama = rays_.turn_x > 0, parallel = dot(rays_.origin_x, rays_.origin_x) > 0;
  const AffineForm distance = square_root(squared_length(along));
  // Depths of a panorama are distances; the spread of a lens's rays is that of a unit direction, not of its depth.
  const AffineForm depth = panorama ? distance : dot(along, scene_.camera.forward());
  const double width = rays_.pixel * (parallel ? 1 : distance.range().high) * (1 + 0x1p-40);
  return {local_radiance(bounds_, patch, rays, width, visible), depth, patch.material};
}

ColorInterval BlockRadiance::range(const SurfaceRays& rays, const BlockPart& part) const {
  const ColorInterval local = range_of(bounds_, rays.local, part);
  const ColorInterval radiance = rays.reflected ? with_reflected(local, *rays.reflected, part)
                                                : with_secondary_rays(bounds_, rays.material, local);
  if (!scene_.depth_cue) return finished(radiance, {1, 1});
  const AffineForm world = restricted(rays.depth, part) * scene_.frame.world_from_render(1.0);
  const double slack = world.magnitude() * 0x1p-44;
  const double first = depth_cue_scale(*scene_.depth_cue, world.range().low - slack);
  const double last = depth_cue_scale(*scene_.depth_cue, world.range().high + slack);
  return finished(radiance, {std::min(first, last), std::max(first, last)});
}

ColorInterval BlockRadiance::primitive(const PrimitiveRef& primitive) const {
  return finished(materials_[scene_.objects.material[scene_.geometry().object_of(primitive)]], any_cue_scale());
}

ColorInterval BlockRadiance::anything() const {
  const ColorInterval radiance = finished(bounds_.any_radiance(), any_cue_scale());
  return scene_.output.alpha ? hull(radiance, ColorInterval{}) : radiance;
}

Interval BlockRadiance::any_cue_scale() const {
  if (!scene_.depth_cue) return {1, 1};
  const auto [low, high] = std::minmax(scene_.depth_cue->front_scale, scene_.depth_cue->back_scale);
  return {low, high};
}

ColorInterval BlockRadiance::finished(ColorInterval radiance, const Interval& cue_scale) const {
  if (bounds_.in_medium)
    for (Interval& channel : radiance) channel.low = 0;
  return scene_.depth_cue ? with_depth_cue(*scene_.depth_cue, cue_scale, radiance) : radiance;
}

}  // namespace tracer
