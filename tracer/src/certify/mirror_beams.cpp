#include "tracer/src/certify/mirror_beams.h"

#include "tracer/src/certify/shadow_range.h"

namespace tracer {
namespace {

/// Footprint of reflected rays: curved mirrors change it, so that filtered textures have any of their colors.
constexpr double any_width = 1e30;

/// Rays that leave a mirror.
std::optional<Beam> reflected_beam(const SurfacePatch& patch, const RayBundle& rays, double reach) {
  const AffineForm along = dot(rays.direction, patch.normal);
  const double rounding = magnitude(rays.direction) * 0x1p-44;
  const AffineVec direction = widened(rays.direction - patch.normal * (along * 2), rounding);
  const RayBundle reflected{patch.hit, direction};
  if (!spreads_little(reflected)) return std::nullopt;
  return Beam(reflected, region_of(reflected, reach));
}

/// [0, high] of the form.
AffineForm down_to_0(const AffineForm& form) { return form_of({0, std::max(0.0, form.range().high)}); }

}  // namespace

MirrorBeams::MirrorBeams(const SceneBounds& bounds)
    : bounds_(bounds), scene_(bounds.scene), occupancy_(bounds), visible_(bounds.scene.lights.size()) {
  const bool culls = scene_.needs.many_lights || scene_.exact.needs.many_lights;
  follows_ = !bounds.approximate.any() && !bounds.in_medium && !culls && std::isfinite(bounds.radiance_max);
  occupancy_.reset(all_);
}

/// Reflection about the geometric normal, by the same factor everywhere.
bool MirrorBeams::is_mirror(const SurfacePatch& patch) const {
  const CompiledMaterial& material = scene_.terms[patch.material];
  const bool smooth = !patch.flat && scene_.geometry().kind_of(patch.primitive.geometry) == GeometryKind::triangles;
  const bool is_plain = std::holds_alternative<Color>(scene_.materials[patch.material].reflection_color);
  return is_plain && !is_black(material.reflectance) && !material.fresnel && !material.transmits && !material.cut_out &&
         !material.has_normal_map && patch.has_normal && !smooth;
}

std::optional<RadianceForms> MirrorBeams::follow(const SurfacePatch& patch, const RayBundle& rays, std::uint32_t depth,
                                                 double throughput) {
  if (!follows_ || depth >= depth_max || !is_mirror(patch)) return std::nullopt;
  const std::optional<Beam> beam = reflected_beam(patch, rays, bounds_.tree.reach());
  if (!beam) return std::nullopt;
  const Color mirror = scene_.terms[patch.material].reflectance;
  const double largest = throughput * max_component(mirror);
  std::optional<RadianceForms> radiance = seen_by(*beam, patch, depth, largest);
  if (!radiance) return std::nullopt;
  // Rays that the integrator terminates add nothing.
  const bool terminates = depth + 1 > scene_.accuracy.max_depth || !(largest * (1 - 0x1p-40) >= scene_.accuracy.cutoff);
  const std::array<double, 3> factor{mirror.r, mirror.g, mirror.b};
  for (std::size_t c = 0; c < 3; ++c) {
    AffineForm& channel = (*radiance)[c];
    channel = (terminates ? down_to_0(channel) : channel) * factor[c];
  }
  return radiance;
}

std::optional<RadianceForms> MirrorBeams::seen_by(const Beam& beam, const SurfacePatch& from, std::uint32_t depth,
                                                  double throughput) {
  const GeometryKind kind = scene_.geometry().kind_of(from.primitive.geometry);
  const bool leaves = from.convex || kind == GeometryKind::triangles || kind == GeometryKind::planes;
  occupancy_.gather(all_, beam.region, entries_max, entries_);
  const std::optional<Occupancy::Cover> cover =
      occupancy_.find_cover(beam, leaves ? from.primitive : PrimitiveRef{}, entries_);
  if (!entries_.empty()) return std::nullopt;
  if (cover)
    return surface(surface_patch(scene_, cover->primitive, beam.rays, cover->hit, Approximations::Shading::exact),
                   beam.rays, depth, throughput);
  RadianceForms radiance;
  if (const Gradient* const gradient = scene_.background->gradient()) {
    const AffineForm share = dot(normalized(beam.rays.direction), scene_.background->up()) * 0.5 + 0.5;
    const auto mixed = [&](double nadir, double zenith) {
      AffineForm form = share * (zenith - nadir) + nadir;
      form.error += (nadir + zenith) * 0x1p-40;
      return form;
    };
    return RadianceForms{mixed(gradient->nadir.r, gradient->zenith.r), mixed(gradient->nadir.g, gradient->zenith.g),
                         mixed(gradient->nadir.b, gradient->zenith.b)};
  }
  for (std::size_t c = 0; c < 3; ++c) radiance[c] = form_of(bounds_.background[c]);
  return radiance;
}

std::optional<RadianceForms> MirrorBeams::surface(const SurfacePatch& patch, const RayBundle& rays, std::uint32_t depth,
                                                  double throughput) {
  if (scene_.terms[patch.material].transmits && bounds_.overlapping_media) return std::nullopt;
  for (std::size_t light = 0; light < visible_.size(); ++light)
    visible_[light] = shadow_range(bounds_, patch, scene_.lights[light], {}, nullptr);
  const LocalRadiance local = local_radiance(bounds_, patch, rays, any_width, visible_);
  const std::optional<RadianceForms> reflected = follow(patch, rays, depth + 1, throughput);
  const Color total = secondary_factor(bounds_, patch.material);
  const std::array<double, 3> factor{total.r, total.g, total.b};
  RadianceForms radiance;
  for (std::size_t c = 0; c < 3; ++c) {
    radiance[c] = form_of(local.emitted_ambient[c]);
    if (local.any_light) {
      const Interval light = local.light[c].range();
      const bool bounded = light.low >= 0 && light.high <= local.light_max[c];
      radiance[c] =
          radiance[c] +
          (bounded ? local.light[c] : form_of({std::max(0.0, light.low), std::min(light.high, local.light_max[c])}));
    }
    radiance[c] = radiance[c] + (reflected ? (*reflected)[c] : form_of({0, factor[c] * bounds_.radiance_max}));
    radiance[c].error += radiance[c].magnitude() * 0x1p-40;
  }
  return radiance;
}

}  // namespace tracer
