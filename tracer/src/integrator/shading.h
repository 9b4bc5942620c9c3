#pragma once
/// Wavefront, hits: what is known of them before any light is asked, sixteen at a time. What few hits need is done for
/// their lanes alone.

#include <algorithm>

#include "tracer/src/integrator/wavefront.h"
#include "tracer/src/materials/shading.h"
#include "tracer/src/shapes/uv_gradients.h"
#include "tracer/src/textures/texture.h"

namespace tracer {

template <class Model>
void Wavefront<Model>::shade_hits(const RayQueue& rays, std::uint32_t depth, Generation& next) {
  facings_.clear();
  corners_.clear();
  if (needs<&Requirements::bump>()) unbent_.assign(hit_ray_.size(), {});
  position_.clear();
  const bool goes_on = needs<&Requirements::reflection>() || needs<&Requirements::refraction>() ||
                       approximate().reflections == Approximations::Reflections::environment;
  const bool notes = notes_first_hits() && depth == 0;
  for (std::size_t first = 0; first < hit_ray_.size(); first += lanes) {
    FacingPacket& facing = facings_.fresh();
    const auto count = static_cast<int>(std::min<std::size_t>(lanes, hit_ray_.size() - first));
    load(rays, hits_.span(), hit_ray_.data() + first, count, hit_, facing);
    if (needs<&Requirements::absorption>()) absorb(rays);
    meet_points(scene_.geometry(), hit_.met, hit_.points);
    for (std::uint32_t i = 0; i < lanes; ++i) {
      facing.hit[i] = static_cast<std::uint32_t>(first) + i;
      hit_.material[i] = scene_.material_of_object[hit_.points.object[i]];
    }
    if (hit_.points.smooth) flatten();
    face(hit_, facing);
    take_materials(scene_.terms, hit_);
    hidden_ = 0;
    if (goes_on && hit_.terms.parts != 0) cross_media(facing);
    weigh(hit_, facing);
    if (needs<&Requirements::textures>() && hit_.terms.textured != 0) find_colors(rays, facing);
    if (needs<&Requirements::bump>() && hit_.terms.any_bends) bend_normals(rays, facing);
    if (hit_.terms.any_own)
      for (int i = 0; i < count; ++i) radiance_[facing.sample[i]] += Color{hit_.own_r[i], hit_.own_g[i], hit_.own_b[i]};
    if (notes) note_first_hits(facing);
    if (approximate().nearest_lights != 0)
      for (int i = 0; i < count; ++i) position_.push_back({hit_.points.x[i], hit_.points.y[i], hit_.points.z[i]});
    if (goes_on && (hit_.terms.mirrors | hit_.terms.parts) != 0) branch(rays, facing, next);
    if (needs<&Requirements::gouraud>()) face_from_corners(rays, facing);
  }
}

template <class Model>
void Wavefront<Model>::absorb(const RayQueue& rays) {
  for (int i = 0; i < lanes; ++i) {
    const Color weight = arriving_weight(rays, static_cast<std::size_t>(hit_.ray[i]));
    hit_.weight_r[i] = weight.r;
    hit_.weight_g[i] = weight.g;
    hit_.weight_b[i] = weight.b;
  }
}

/// Surfaces that are shaded flat have no other normals than their faces'.
template <class Model>
void Wavefront<Model>::flatten() {
  PointPacket& p = hit_.points;
  if (approximate().shading == Approximations::Shading::flat) p.smooth = false;
  for (int i = 0; i < lanes; ++i) {
    if (shading_of(terms_of_lane(i).shading, approximate().shading) != Material::Shading::flat) continue;
    p.normal_x[i] = p.face_x[i];
    p.normal_y[i] = p.face_y[i];
    p.normal_z[i] = p.face_z[i];
    p.offset_x[i] = p.offset_y[i] = p.offset_z[i] = 0;
  }
}

template <class Model>
void Wavefront<Model>::find_colors(const RayQueue& rays, FacingPacket& facing) {
  const LaneMask textured = hit_.terms.textured & first_lanes(hit_.count);
  for_each_lane(textured, [&](int i) {
    const Surface surface = surface_of_lane(facing, i);
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
    take_color(own_light(material, color, scene_.ambient), diffuse_share(material, color), i, hit_, facing);
  });
}

template <class Model>
Surface Wavefront<Model>::surface_of_lane(const FacingPacket& f, int i) const {
  const PointPacket& p = hit_.points;
  Surface surface;
  surface.point = {{p.x[i], p.y[i], p.z[i]}, {p.error_x[i], p.error_y[i], p.error_z[i]}};
  surface.geometric_normal = {p.face_x[i], p.face_y[i], p.face_z[i]};
  surface.normal = {f.normal_x[i], f.normal_y[i], f.normal_z[i]};
  surface.back = hit_.behind[i] > 0;
  surface.material = hit_.material[i];
  surface.object = p.object[i];
  const MaterialTerms& terms = terms_of_lane(i);
  if (needs<&Requirements::textures>() && (terms.textured || terms.bends))
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
void Wavefront<Model>::note_first_hits(const FacingPacket& facing) {
  for_each_lane(first_lanes(hit_.count) & ~hidden_, [&](int i) {
    const std::uint32_t sample = facing.sample[i];
    first_hits_.normal[sample] = {facing.normal_x[i], facing.normal_y[i], facing.normal_z[i]};
    first_hits_.albedo[sample] = color_of_lane(i);
    first_hits_.object[sample] = hit_.points.object[i];
  });
}

/// What is shaded after Gouraud is lit at the corners of its triangle, and nowhere else.
template <class Model>
void Wavefront<Model>::face_from_corners(const RayQueue& rays, FacingPacket& facing) {
  for (int i = 0; i < hit_.count; ++i) {
    if (!face_at_corners(rays, facing, i)) continue;
    facing.diffuse_r[i] = facing.diffuse_g[i] = facing.diffuse_b[i] = 0;
    facing.specular_r[i] = facing.specular_g[i] = facing.specular_b[i] = 0;
  }
}

/// False: this lane is none of that.
template <class Model>
bool Wavefront<Model>::face_at_corners(const RayQueue& rays, const FacingPacket& facing, int lane) {
  const MaterialTerms& terms = terms_of_lane(lane);
  if (shading_of(terms.shading, approximate().shading) != Material::Shading::gouraud) return false;
  const auto ray = static_cast<std::size_t>(hit_.ray[lane]);
  const std::optional<Corners> corners = corners_at(scene_, hits_.at(ray));
  if (!corners) return false;
  if (needs<&Requirements::bump>()) unbent_[facing.hit[lane]] = {};  // textures do not bend the corners' normals
  const Color diffuse{facing.diffuse_r[lane], facing.diffuse_g[lane], facing.diffuse_b[lane]};
  const Color specular = hit_.weight(lane) * terms.specular;
  for (const Corner& corner : *corners)
    corners_.push({.point = corner.point,
                   .face = {facing.face_x[lane], facing.face_y[lane], facing.face_z[lane]},
                   .normal = hit_.behind[lane] > 0 ? -corner.normal : corner.normal,
                   .to_eye = normalize(rays.origin(ray) - corner.point.position),
                   .diffuse = diffuse * corner.weight,
                   .specular = specular * corner.weight,
                   .shininess = terms.shininess,
                   .halfway = terms.halfway,
                   .hit = facing.hit[lane],
                   .sample = facing.sample[lane],
                   .media = facing.media[lane],
                   .from = facing.from[lane]});
  return true;
}

}  // namespace tracer
