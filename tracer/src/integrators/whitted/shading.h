#pragma once
/// Wavefront, hits: what is known of them before any light is asked, sixteen at a time. What few hits need is done for
/// their lanes alone.

#include <algorithm>

#include "tracer/src/integrators/whitted/wavefront.h"
#include "tracer/src/interaction/uv_gradients.h"
#include "tracer/src/materials/shading_mode.h"
#include "tracer/src/textures/texture.h"

namespace tracer {

template <class Model>
void Wavefront<Model>::shade_hits(const RayQueue& rays, std::uint32_t depth, BounceQueues& next) {
  shading_points_.clear();
  corner_points_.clear();
  if (needs<&Requirements::bump>()) unperturbed_normal_.assign(hit_ray_.size(), {});
  position_.clear();
  const bool goes_on = needs<&Requirements::reflection>() || needs<&Requirements::refraction>() ||
                       approximate().reflections == Approximations::Reflections::environment;
  const bool notes = writes_gbuffer() && depth == 0;
  for (std::size_t first = 0; first < hit_ray_.size(); first += lanes) {
    ShadingPointPacket& shading_point = shading_points_.fresh();
    const auto count = static_cast<int>(std::min<std::size_t>(lanes, hit_ray_.size() - first));
    load(rays, hits_.span(), hit_ray_.data() + first, count, hit_, shading_point);
    if (needs<&Requirements::absorption>()) absorb(rays);
    meet_points(scene_.geometry(), hit_.met, hit_.points);
    for (std::uint32_t i = 0; i < lanes; ++i) {
      shading_point.hit[i] = static_cast<std::uint32_t>(first) + i;
      hit_.material[i] = scene_.material_of_object[hit_.points.object[i]];
    }
    if (hit_.points.smooth) flatten();
    face(hit_, shading_point);
    take_materials(scene_.terms, hit_);
    nested_boundary_ = 0;
    if (goes_on && hit_.terms.parts != 0) cross_media(shading_point);
    weigh(hit_, shading_point);
    if (needs<&Requirements::textures>() && hit_.terms.textured != 0) find_colors(rays, shading_point);
    if (needs<&Requirements::bump>() && hit_.terms.any_bends) perturb_normals(rays, shading_point);
    if (hit_.terms.any_own)
      for (int i = 0; i < count; ++i)
        radiance_[shading_point.sample[i]] += Color{hit_.own_r[i], hit_.own_g[i], hit_.own_b[i]};
    if (notes) write_gbuffer(shading_point);
    if (approximate().nearest_lights != 0)
      for (int i = 0; i < count; ++i) position_.push_back({hit_.points.x[i], hit_.points.y[i], hit_.points.z[i]});
    if (goes_on && (hit_.terms.mirrors | hit_.terms.parts) != 0) branch(rays, shading_point, next);
    if (needs<&Requirements::gouraud>()) face_from_corners(rays, shading_point);
  }
}

template <class Model>
void Wavefront<Model>::absorb(const RayQueue& rays) {
  for (int i = 0; i < lanes; ++i) {
    const Color throughput = throughput_at_hit(rays, static_cast<std::size_t>(hit_.ray[i]));
    hit_.weight_r[i] = throughput.r;
    hit_.weight_g[i] = throughput.g;
    hit_.weight_b[i] = throughput.b;
  }
}

/// Surfaces that are shaded flat have no other normals than their faces'.
template <class Model>
void Wavefront<Model>::flatten() {
  PointPacket& p = hit_.points;
  if (approximate().shading == Approximations::Shading::flat) p.smooth = false;
  for (int i = 0; i < lanes; ++i) {
    if (shading_of(compiled_material_of_lane(i).shading, approximate().shading) != Material::Shading::flat) continue;
    p.normal_x[i] = p.face_x[i];
    p.normal_y[i] = p.face_y[i];
    p.normal_z[i] = p.face_z[i];
    p.offset_x[i] = p.offset_y[i] = p.offset_z[i] = 0;
  }
}

template <class Model>
void Wavefront<Model>::find_colors(const RayQueue& rays, ShadingPointPacket& shading_point) {
  const LaneMask textured = hit_.terms.textured & first_lanes(hit_.count);
  for_each_lane(textured, [&](int i) {
    const Surface surface = surface_of_lane(shading_point, i);
    uv_[i] = surface.uv;
    if (!needs<&Requirements::filtered_textures>()) return;
    const auto ray = static_cast<std::size_t>(hit_.ray[i]);
    covered_.put(i, uv_gradients_at(scene_, hits_.at(ray), surface), rays.direction(ray),
                 rays.cone(ray).width_at(hits_.t[ray]));
  });
  if (needs<&Requirements::filtered_textures>()) find_covered(hit_.points, covered_);
  for_each_lane(textured, [&](int i) {
    const Color color = color_of_lane(i);
    const Material& material = scene_.materials[hit_.material[i]];
    take_color(local_radiance_bound(material, color, scene_.ambient), diffuse_share(material, color), i, hit_,
               shading_point);
  });
}

template <class Model>
Surface Wavefront<Model>::surface_of_lane(const ShadingPointPacket& f, int i) const {
  const PointPacket& p = hit_.points;
  Surface surface;
  surface.point = {{p.x[i], p.y[i], p.z[i]}, {p.error_x[i], p.error_y[i], p.error_z[i]}};
  surface.geometric_normal = {p.face_x[i], p.face_y[i], p.face_z[i]};
  surface.normal = {f.normal_x[i], f.normal_y[i], f.normal_z[i]};
  surface.back = hit_.behind[i] > 0;
  surface.material = hit_.material[i];
  surface.object = p.object[i];
  const CompiledMaterial& terms = compiled_material_of_lane(i);
  if (needs<&Requirements::textures>() && (terms.textured || terms.has_normal_map))
    surface.uv = uv_at(scene_, hits_.at(static_cast<std::size_t>(hit_.ray[i])), surface);
  return surface;
}

/// C of the material there. Precondition: find_colors was asked where textures are.
template <class Model>
Color Wavefront<Model>::color_of_lane(int lane) const {
  const ColorOrTexture& color = scene_.materials[hit_.material[lane]].color;
  const auto* id = std::get_if<TextureId>(&color);
  if (id == nullptr) return std::get<Color>(color);
  const auto [texture, image] = texture_of(*id);
  const bool filtered = texture.filter == Texture::Filter::mipmap;
  const Vec2 covered = filtered ? Vec2{covered_.u[lane], covered_.v[lane]} : Vec2{};
  return texture_color(texture, uv_[lane], covered, image);
}

template <class Model>
typename Wavefront<Model>::TextureOf Wavefront<Model>::texture_of(TextureId id) const {
  return {scene_.textures[id.index], scene_.images[id.index].get()};
}

/// Nothing of a texture that is not filtered.
template <class Model>
Vec2 Wavefront<Model>::covered_of(const RayQueue& rays, std::size_t ray, const Surface& surface,
                                  const Texture& texture) const {
  if (texture.filter != Texture::Filter::mipmap) return {};
  return covered_uv(uv_gradients_at(scene_, hits_.at(ray), surface), surface.geometric_normal, rays.direction(ray),
                    rays.cone(ray).width_at(hits_.t[ray]));
}

template <class Model>
void Wavefront<Model>::write_gbuffer(const ShadingPointPacket& shading_point) {
  for_each_lane(first_lanes(hit_.count) & ~nested_boundary_, [&](int i) {
    const std::uint32_t sample = shading_point.sample[i];
    gbuffer_.normal[sample] = {shading_point.normal_x[i], shading_point.normal_y[i], shading_point.normal_z[i]};
    gbuffer_.albedo[sample] = color_of_lane(i);
    gbuffer_.object[sample] = hit_.points.object[i];
  });
}

/// What is shaded after Gouraud is lit at the corners of its triangle, and nowhere else.
template <class Model>
void Wavefront<Model>::face_from_corners(const RayQueue& rays, ShadingPointPacket& shading_point) {
  for (int i = 0; i < hit_.count; ++i) {
    if (!face_at_corners(rays, shading_point, i)) continue;
    shading_point.diffuse_r[i] = shading_point.diffuse_g[i] = shading_point.diffuse_b[i] = 0;
    shading_point.specular_r[i] = shading_point.specular_g[i] = shading_point.specular_b[i] = 0;
  }
}

/// False: this lane is none of that.
template <class Model>
bool Wavefront<Model>::face_at_corners(const RayQueue& rays, const ShadingPointPacket& shading_point, int lane) {
  const CompiledMaterial& terms = compiled_material_of_lane(lane);
  if (shading_of(terms.shading, approximate().shading) != Material::Shading::gouraud) return false;
  const auto ray = static_cast<std::size_t>(hit_.ray[lane]);
  const std::optional<Corners> corners = corners_at(scene_, hits_.at(ray));
  if (!corners) return false;
  if (needs<&Requirements::bump>())
    unperturbed_normal_[shading_point.hit[lane]] = {};  // textures do not bend the corners' normals
  const Color diffuse{shading_point.diffuse_r[lane], shading_point.diffuse_g[lane], shading_point.diffuse_b[lane]};
  const Color specular = hit_.throughput(lane) * terms.specular;
  for (const Corner& corner : *corners)
    corner_points_.push({.point = corner.point,
                         .face = {shading_point.face_x[lane], shading_point.face_y[lane], shading_point.face_z[lane]},
                         .normal = hit_.behind[lane] > 0 ? -corner.normal : corner.normal,
                         .to_eye = normalize(rays.origin(ray) - corner.point.position),
                         .diffuse = diffuse * corner.weight,
                         .specular = specular * corner.weight,
                         .shininess = terms.shininess,
                         .blinn = terms.blinn,
                         .hit = shading_point.hit[lane],
                         .sample = shading_point.sample[lane],
                         .media = shading_point.media[lane],
                         .from = shading_point.from[lane]});
  return true;
}

}  // namespace tracer
