#pragma once
/// The Whitted integrator as a wavefront: a batch of samples is traced bounce by bounce. A queue of rays is
/// intersected, its hits are shaded in packets of 16, and the secondary rays fill the queues of the next bounce. There
/// is no recursion, so that depth alone costs no memory.

#include <vector>

#include "tracer/src/integrators/tracer.h"
#include "tracer/src/integrators/whitted/direct_lighting.h"
#include "tracer/src/integrators/whitted/secondary_rays.h"
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

  [[nodiscard]] Surface surface_of_lane(const ShadingPointPacket& shading_points, int i) const {
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

/// The integrator for a set of features. Contributions to one sample are added in an order that depends on that sample
/// alone (bounce, then kind, then the order of the parents, then light), so that no choice of batch, tile or thread
/// changes a bit of the image.
template <class Features>
class Wavefront : public Tracer {
 public:
  Wavefront(const CompiledScene& scene, const RenderControl& control, const Approximations& approximations)
      : state_(scene, control, approximations), textures_(state_), lighting_(state_), secondary_(state_) {}
  Wavefront(Wavefront&&) = delete;

  [[nodiscard]] Batch& batch() override { return state_.batch; }
  bool trace() override;
  /// Traces these rays in place of camera rays, one for each sample of the batch: samples without a place in the image.
  bool trace(const RayQueue& rays);
  /// Traces diffuse rays in place of camera rays, one for each sample of the batch, and appends to `terminations` where
  /// their paths end at patches; radiance() is the rest. Precondition: the scene has patches.
  bool trace_from_patches(const RayQueue& diffuse, std::vector<PathTermination>& terminations);

  [[nodiscard]] const std::vector<Color>& radiance() const override { return state_.radiance; }
  [[nodiscard]] const std::vector<float>& omitted() const override { return state_.omitted; }
  [[nodiscard]] const std::vector<SampleSignature>& signatures() const override { return state_.signatures; }
  [[nodiscard]] const GBuffer& gbuffer() const override { return state_.gbuffer; }
  [[nodiscard]] const RenderStatistics& statistics() const override { return state_.statistics; }

 private:
  bool trace_all(BounceQueuesPtr first_bounce);
  BounceQueuesPtr acquire_queues(std::uint32_t depth);
  void release_queues(BounceQueuesPtr queues);
  void generate_camera_rays(RayQueue& rays) const;
  void trace_bounce(const BounceQueues& bounce, BounceQueues& next);
  HitSpan find_hits(const RayQueue& rays, Coherence coherence);
  void intersect(const RayQueue& rays, std::uint32_t depth, Coherence coherence);
  void handle_escaped_rays(const RayQueue& rays, std::uint32_t depth);
  void load_hits(const RayQueue& rays, std::size_t first, ShadingPointPacket& shading_points);
  void shade_hits(const RayQueue& rays, std::uint32_t depth, BounceQueues& next);
  [[nodiscard]] double weight_of_sky(const RayQueue& rays, std::size_t ray) const;
  [[nodiscard]] double weight_of_emission(const RayQueue& rays, std::size_t ray, const PrimitiveRef& hit) const;
  [[nodiscard]] Color emission_of_lane(const RayQueue& rays, int lane) const;
  void add_emission(const RayQueue& rays);
  void apply_absorption(const RayQueue& rays);
  void flatten_normals();
  void write_gbuffer(const ShadingPointPacket& shading_points);
  void sign(const RayQueue& rays, std::uint32_t depth, const ShadingPointPacket& shading_points);

  WavefrontState<Features> state_;
  std::vector<std::uint32_t> escaped_rays_;  ///< rays of the queue that hit no surface
  TextureLookup<Features> textures_;
  DirectLighting<Features> lighting_;
  SecondaryRays<Features> secondary_;
  std::vector<BounceQueuesPtr> released_queues_;  ///< kept for their memory
};

}  // namespace tracer
