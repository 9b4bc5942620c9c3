#pragma once
/// Textures of the Whitted integrator.

#include <vector>

#include "tracer/src/integrators/whitted/wavefront_state.h"
#include "tracer/src/interaction/surface.h"
#include "tracer/src/textures/texture.h"
#include "tracer/src/textures/texture_cell.h"

namespace tracer {

/// Textures at a packet of hits: colors, filter footprints, bump and normal maps. Works lane by lane, since few hits
/// need it.
template <class Features>
class TextureLookup {
 public:
  explicit TextureLookup(WavefrontState<Features>& state) : state_(state) {}

  /// Applies the colors of textured materials to the packet.
  void apply_colors(const RayQueue& rays, ShadingPointPacket& shading_points) {
    HitPacket& hit = state_.hit;
    const LaneMask textured = hit.coefficients.textured & first_lanes(hit.count);
    for_each_lane(textured, [&](int i) {
      const Surface surface = surface_of_lane(shading_points, i);
      uv_[i] = surface.uv;
      if (!filters()) return;
      const auto ray = static_cast<std::size_t>(hit.ray[i]);
      const UvGradients gradients = uv_gradients_at(state_.scene, state_.hits.at(ray), surface);
      footprint_.gradient_u.set(i, gradients.u);
      footprint_.gradient_v.set(i, gradients.v);
      footprint_.direction.set(i, rays.direction(ray));
      footprint_.width[i] = rays.cone(ray).width_at(state_.hits.t[ray]);
    });
    if (filters()) compute_footprints(hit.points, footprint_);
    for_each_lane(textured, [&](int i) {
      const Material& material = state_.scene.materials[hit.material[i]];
      const Color& ambient = state_.ambient;
      if (state_.material_of_lane(i).only_color_textured) {  // by far the most frequent
        const Color color = texture_at_lane(std::get<TextureId>(material.color), i), throughput = hit.throughput[i];
        hit.emitted.set(i, throughput * emitted_ambient(material, std::get<Color>(material.emission), color, ambient));
        shading_points.diffuse.set(i, throughput * diffuse_coefficient(material, color));
        return;
      }
      set_textured_coefficients(
          coefficients(material, ambient, [&](const ColorOrTexture& color) { return at_lane(color, i); }), i, hit,
          shading_points);
    });
  }

  /// Evaluates the principled lanes for the direction of the eye. Precondition: apply_colors() was called if the packet
  /// has textured lanes, and the normals are final.
  void evaluate_principled(const RayQueue& rays, ShadingPointPacket& shading_points) {
    const HitPacket& hit = state_.hit;
    const double mirror_roughness = state_.approximate().mirror_roughness;
    for (int i = 0; i < hit.count; ++i) {
      PrincipledHit& to = state_.principled[i];
      to.weight = {};
      if (!state_.material_of_lane(i).principled) continue;
      const Material& material = state_.scene.materials[hit.material[i]];
      const auto color_of = [&](const ColorOrTexture& color) { return at_lane(color, i); };
      PrincipledSurface surface = principled_surface(material, color_of);
      const double alpha = rays.path_state(static_cast<std::size_t>(hit.ray[i])).alpha;
      surface.highlight = std::max(surface.highlight, alpha);
      surface.mirror = mirror_roughness > 0 && surface.alpha <= mirror_roughness * mirror_roughness;
      // An interpolated normal may point away from the ray; the normal of the face never does.
      const Vec3 outward = hit.points.face[i] * (1 - 2 * hit.back_face[i]), to_eye = shading_points.to_eye[i];
      const bool toward_eye = dot(shading_points.normal[i], to_eye) > 0;
      to.point = PrincipledPoint(surface, toward_eye ? shading_points.normal[i] : outward, to_eye);
      to.weight = hit.throughput[i] * opacity(material, color_of);
      shading_points.diffuse.set(i, to.weight * to.point.matt_albedo());
    }
  }

  /// Color C of the lane's material. Precondition: apply_colors() was called if the packet has textured lanes.
  [[nodiscard]] Color color_of_lane(int lane) const {
    return at_lane(state_.scene.materials[state_.hit.material[lane]].color, lane);
  }

  /// Adds the texture of that color, at the hit of a camera ray that stands for the whole pixel. Precondition: as
  /// above.
  void sign(const RayQueue& rays, const ShadingPointPacket& shading_points, int lane,
            SampleSignature& signature) const {
    const auto* id = std::get_if<TextureId>(&state_.scene.materials[state_.hit.material[lane]].color);
    if (id == nullptr) return;
    const auto width_of_pixel = [&] {
      const auto ray = static_cast<std::size_t>(state_.hit.ray[lane]);
      const Surface surface = surface_of_lane(shading_points, lane);
      const CompiledCamera::Footprint pixel = state_.scene.camera.pixel_footprint(rays.direction(ray));
      return uv_footprint(uv_gradients_at(state_.scene, state_.hits.at(ray), surface), surface.geometric_normal,
                          rays.direction(ray), pixel.width + std::abs(pixel.spread) * state_.hits.t[ray]);
    };
    const Vec2 width = filters() ? Vec2{footprint_.u[lane], footprint_.v[lane]} : width_of_pixel();
    add_texture(signature, state_.scene.textures[id->index], uv_[lane], width, image_of(*id));
  }

  /// Applies bump and normal maps; stores the normals before that at `unperturbed`, by hit.
  void perturb_normals(const RayQueue& rays, ShadingPointPacket& shading_points, std::vector<Vec3>& unperturbed) {
    for (int lane = 0; lane < state_.hit.count; ++lane) {
      if (!state_.material_of_lane(lane).has_normal_map) continue;
      const Surface surface = surface_of_lane(shading_points, lane);
      unperturbed[shading_points.hit[lane]] = surface.normal;
      // Textures perturb the front; the back is its reverse.
      const Vec3 outward =
          perturbed(surface.back ? -surface.normal : surface.normal, rays, state_.hit.ray[lane], surface);
      shading_points.normal.set(lane, surface.back ? -outward : outward);
    }
  }

 private:
  [[nodiscard]] bool filters() const { return state_.template needs<&Requirements::filtered_textures>(); }

  [[nodiscard]] const ImageMap* image_of(TextureId id) const { return state_.scene.images[id.index].get(); }

  [[nodiscard]] Color at_lane(const ColorOrTexture& color, int lane) const {
    const auto* id = std::get_if<TextureId>(&color);
    return id == nullptr ? std::get<Color>(color) : texture_at_lane(*id, lane);
  }

  [[nodiscard]] WHITTLE_INLINE Color texture_at_lane(TextureId id, int lane) const {
    const Texture& texture = state_.scene.textures[id.index];
    const bool filtered = texture.filter == Texture::Filter::mipmap;
    const Vec2 footprint = filtered ? Vec2{footprint_.u[lane], footprint_.v[lane]} : Vec2{};
    return texture_color(texture, uv_[lane], footprint, image_of(id));
  }

  [[nodiscard]] Vec3 perturbed(Vec3 outward, const RayQueue& rays, int lane_ray, const Surface& surface) const {
    const auto ray = static_cast<std::size_t>(lane_ray);
    const Material& material = state_.scene.materials[surface.material];
    const UvGradients gradients = uv_gradients_at(state_.scene, state_.hits.at(ray), surface);
    if (material.normal_map) {
      const Texture& texture = state_.scene.textures[material.normal_map->index];
      const Color color =
          texture_color(texture, surface.uv, footprint_of(rays, ray, surface, texture), image_of(*material.normal_map));
      outward = mapped_normal(outward, gradients, tangent_normal(color, material.normal_scale));
    }
    if (material.bump) {
      const TextureId id = material.bump->texture;
      const Texture& texture = state_.scene.textures[id.index];
      const Vec2 slope = height_slope(texture, surface.uv, footprint_of(rays, ray, surface, texture), image_of(id));
      const double scale = state_.scene.frame.render_from_world(material.bump->scale);
      outward = bumped_normal(outward, gradients, {slope.x * scale, slope.y * scale});
    }
    return outward;
  }

  [[nodiscard]] WHITTLE_INLINE Surface surface_of_lane(const ShadingPointPacket& shading_points, int i) const {
    const HitPacket& hit = state_.hit;
    const PointPacket& p = hit.points;
    Surface surface;
    surface.point = {p.position[i], p.error[i]};
    surface.geometric_normal = p.face[i];
    surface.normal = shading_points.normal[i];
    surface.back = hit.back_face[i] > 0;
    surface.material = hit.material[i];
    surface.object = p.object[i];
    const CompiledMaterial& material = state_.material_of_lane(i);
    if (state_.template needs<&Requirements::textures>() && (material.textured || material.has_normal_map))
      surface.uv = uv_at(state_.scene, state_.hits.at(static_cast<std::size_t>(hit.ray[i])), surface);
    return surface;
  }

  /// Zero for textures that are not filtered.
  [[nodiscard]] Vec2 footprint_of(const RayQueue& rays, std::size_t ray, const Surface& surface,
                                  const Texture& texture) const {
    if (texture.filter != Texture::Filter::mipmap) return {};
    return uv_footprint(uv_gradients_at(state_.scene, state_.hits.at(ray), surface), surface.geometric_normal,
                        rays.direction(ray), rays.cone(ray).width_at(state_.hits.t[ray]));
  }

  WavefrontState<Features>& state_;
  Vec2 uv_[lanes] = {};
  FootprintPacket footprint_ = {};
};

}  // namespace tracer
