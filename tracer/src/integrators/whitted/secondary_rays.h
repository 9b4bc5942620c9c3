#pragma once
/// Secondary rays: spawns reflected and transmitted rays at a packet of hits, or terminates them.

#include "tracer/src/integrators/whitted/diffuse_rays.h"
#include "tracer/src/integrators/whitted/wavefront_state.h"
#include "tracer/src/math/optics.h"

namespace tracer {

/// Refractive indices on the incident and the other side of the surfaces; positive in unused lanes.
struct alignas(64) InterfacePacket {
  double n_from[lanes], n_to[lanes];
  InterfacePacket() {
    std::fill_n(n_from, lanes, 1.0);
    std::fill_n(n_to, lanes, 1.0);
  }
};

/// Reflected rays of a packet without splits. A ray that an interpolated or perturbed normal sends below the surface is
/// reflected once more in the face.
void spawn_reflection(const HitPacket& packet, const ShadingPointPacket& shading_points,
                      SecondaryRayPacket& reflection);

/// Rays by Snell's law and Fresnel's equations. Lanes without splits get the same bits as by spawn_reflection().
/// `normals`: those of the shading points, or of facets. `perturbed`: some are not those of the faces; rays that these
/// refract back to the incident side are reflected in the face.
void spawn_dielectric(const HitPacket& packet, const ShadingPointPacket& shading_points, const VecLanes& normals,
                      const InterfacePacket& interfaces, bool perturbed, SecondaryRayPacket& reflection,
                      SecondaryRayPacket& transmission);

/// Hash of the bounces of a ray that rough facets reflect: beyond the keys of all others.
WHITTLE_INLINE std::uint32_t glossy_path(std::uint32_t path) {
  return static_cast<std::uint32_t>(mix(path | std::uint64_t{1} << 41));
}

/// Lanes of `going` whose throughput is at most this one, or NaN.
LaneMask not_above(const SecondaryRayPacket& rays, double throughput);

template <class Features>
class SecondaryRays {
 public:
  explicit SecondaryRays(WavefrontState<Features>& state) : state_(state), diffuse_(state) {}

  /// Finds the media on both sides of the surfaces that split light. Hits on nested boundaries lose their throughput,
  /// so that they are not shaded.
  void cross_media(const ShadingPointPacket& shading_points) {
    nested_boundary_ = 0;
    HitPacket& hit = state_.hit;
    if (hit.coefficients.splits == 0) return;
    MediumStack& media = state_.media;
    for_each_lane(hit.coefficients.splits & first_lanes(hit.count), [&](int i) {
      const CompiledMaterial& material = state_.material_of_lane(i);
      const bool back = hit.back_face[i] > 0;
      const MediumStack::List before = shading_points.media[i];
      if (!material.transmits) {
        interfaces_.n_from[i] = media.ior(media.current_medium(before));
        interfaces_.n_to[i] = material.ior;
        medium_after_[i] = before;  // through a cut-out
        return;
      }
      const MediumStack::Crossing crossing = media.cross(before, hit.points.object[i], back);
      medium_after_[i] = crossing.after;
      // A back-face hit on a surface the ray never entered (an open mesh): treat its own medium as the incident one.
      interfaces_.n_from[i] = material.refracts && crossing.unentered ? material.ior : media.ior(crossing.near);
      interfaces_.n_to[i] = material.refracts ? media.ior(crossing.far) : material.ior;
      if (crossing.hidden && state_.template needs<&Requirements::overlapping_media>() &&
          state_.template needs<&Requirements::refraction>())
        nested_boundary_ |= lane_bit(i);
    });
    for_each_lane(nested_boundary_, [&](int i) { hit.throughput.set(i, {}); });
  }

  /// Media behind a lane's surface, and the index of refraction there over that in front of it: 1 unless it refracts.
  /// Precondition: cross_media() was called for the packet.
  struct FarSide {
    MediumStack::List media;
    double eta;
  };
  [[nodiscard]] FarSide far_side(const ShadingPointPacket& shading_points, int lane) const {
    const CoefficientPacket& coefficients = state_.hit.coefficients;
    if ((coefficients.splits >> lane & 1) == 0) return {shading_points.media[lane], 1};
    return {medium_after_[lane],
            coefficients.refracts[lane] > 0 ? interfaces_.n_to[lane] / interfaces_.n_from[lane] : 1};
  }

  /// Lanes on surfaces within a solid of higher priority.
  [[nodiscard]] LaneMask nested_boundary() const { return nested_boundary_; }

  /// Precondition: cross_media() was called for the packet.
  void spawn(const RayQueue& rays, const ShadingPointPacket& shading_points, BounceQueues& next) {
    if (has_principled()) spawn_glossy(shading_points);
    spawn_specular(shading_points);
    if (has_principled()) attenuate_sheets();
    const LaneMask trapped = find_trapped();
    if (has_diffuse())
      diffuse_.begin(
          rays, shading_points, [&](int lane) { return far_side(shading_points, lane).media; }, trapped);
    // Lane by lane: the order of additions to one sample must not depend on the packet.
    const double most = state_.termination.most;
    LaneMask below = not_above(reflection_, most) | not_above(transmission_, most) | trapped;
    if (has_principled()) below |= not_above(glossy_, most);
    if (has_diffuse()) below = (below | not_above(diffuse_.rays(), most)) & ~diffuse_.after_diffuse();
    for_each_lane(below, [&](int i) {
      const double late = (trapped >> i & 1) != 0 ? reflection_.largest[i] * state_.termination.trapped_growth
                                                  : throughput_of_late_rays(rays, i);
      terminate(transmission_, 1, late, shading_points.sample[i], i);
      terminate(reflection_, 0, late, shading_points.sample[i], i);
      if (has_principled()) terminate(glossy_, glossy_kind, late, shading_points.sample[i], i);
      if (has_diffuse()) terminate(diffuse_.rays(), diffuse_kind, late, shading_points.sample[i], i);
    });
    if (nested_boundary_ != 0) skip_nested_boundary(rays);
    if (!has_diffuse() && (reflection_.going | transmission_.going | glossy_.going) == 0) return;
    if (state_.termination.all) {
      for_each_ray([&](const SecondaryRayPacket& packet, int i) {
        terminate_at_max_depth(packet.largest[i], shading_points.sample[i]);
      });
      return;
    }
    if (has_diffuse()) spawn_diffuse(rays, shading_points, next);
    if (state_.approximate().reflections == Approximations::Reflections::environment) {
      for_each_specular_ray([&](const SecondaryRayPacket& packet, int i) {
        add_environment_radiance(rays, packet, i, shading_points.sample[i]);
      });
    } else {
      push_rays(rays, transmission_, shading_points, medium_after_, next.refraction);
      push_rays(rays, reflection_, shading_points, shading_points.media, next.reflection);
      if (has_principled()) push_rays(rays, glossy_, shading_points, shading_points.media, next.reflection);
    }
  }

 private:
  static constexpr std::uint64_t diffuse_kind = std::uint64_t{1} << 40, glossy_kind = std::uint64_t{1} << 41;

  [[nodiscard]] bool has_principled() const { return state_.template needs<&Requirements::principled>(); }
  [[nodiscard]] bool has_diffuse() const { return state_.template needs<&Requirements::global_light>(); }

  template <class Work>
  void for_each_specular_ray(const Work& work) {
    for_each_lane(reflection_.going | transmission_.going | glossy_.going, [&](int i) {
      for (const SecondaryRayPacket* packet : {&transmission_, &reflection_, &glossy_})
        if ((packet->going >> i & 1) != 0) work(*packet, i);
    });
  }
  template <class Work>
  void for_each_ray(const Work& work) {
    for_each_specular_ray(work);
    if (has_diffuse()) for_each_lane(diffuse_.rays().going, [&](int i) { work(diffuse_.rays(), i); });
  }

  void spawn_specular(const ShadingPointPacket& shading_points) {
    const HitPacket& hit = state_.hit;
    transmission_.going = 0;
    // Only diffuse surfaces call this where nothing is specular.
    const bool none = has_diffuse() &&
                      (!state_.spawns_secondary_rays() || (hit.coefficients.splits | hit.coefficients.reflects) == 0);
    if (none) {
      reflection_.going = 0;
    } else if (hit.coefficients.splits == 0) {
      spawn_reflection(hit, shading_points, reflection_);
    } else {
      const bool perturbed = hit.points.smooth || state_.template needs<&Requirements::bump>() || has_principled();
      const VecLanes& normals = has_principled() ? facets_.normal : shading_points.normal;
      spawn_dielectric(hit, shading_points, normals, interfaces_, perturbed, reflection_, transmission_);
      reflection_.going &= ~nested_boundary_;
      transmission_.going &= ~nested_boundary_;
    }
  }

  /// Selects a facet for each principled lane and sets the rays that the opaque ones reflect. Those that leave below
  /// the face of a triangle are dropped, as light from there is; on mirrors they are reflected in the face.
  void spawn_glossy(const ShadingPointPacket& shading_points) {
    const HitPacket& hit = state_.hit;
    glossy_.going = 0;
    facets_.normal = shading_points.normal;
    seed(state_, shading_points, facets_.random);
    PointLanes points;
    random_points(facets_.random, Choice::facet, points);
    const bool reflects = state_.approximate().reflections != Approximations::Reflections::none;
    for (int i = 0; i < hit.count; ++i) {
      const PrincipledHit& at = state_.principled[i];
      if (is_black(at.weight)) continue;
      const Vec2 xi{points.x[i], points.y[i]};
      facets_.normal.set(i, at.point.sample_facet(xi));
      PrincipledPoint::Sample sample = at.point.sample(xi);
      const Vec3 outward = hit.points.face[i] * (1 - 2 * hit.back_face[i]);
      if (dot(sample.direction, outward) < 0) {
        if (!at.point.is_smooth()) continue;
        sample.direction = unit(reflected(sample.direction, outward));
      }
      const Color throughput = at.weight * sample.factor;
      if (is_black(throughput) || !reflects) continue;
      glossy_.going |= lane_bit(i);
      glossy_.throughput.set(i, throughput);
      glossy_.largest[i] = max_component(throughput);
      glossy_.direction.set(i, sample.direction);
      glossy_.origin.set(i, clear_of(shading_points.position[i], shading_points.face[i], shading_points.clearance[i],
                                     sample.direction));
      glossy_.path[i] = glossy_path(hit.path[i]);
      facets_.density[i] = sample.density;
    }
  }

  /// Thin sheets transmit what their facets do not reflect.
  void attenuate_sheets() {
    for_each_lane(transmission_.going, [&](int i) {
      const PrincipledHit& at = state_.principled[i];
      const Color kept = at.weight * at.point.surface().sheet * at.point.glossy_albedo(),
                  all = transmission_.throughput[i];
      if (is_black(kept)) return;
      const Color left{std::max(all.r - kept.r, 0.0), std::max(all.g - kept.g, 0.0), std::max(all.b - kept.b, 0.0)};
      transmission_.throughput.set(i, left);
      transmission_.largest[i] = max_component(left);
    });
  }

  /// Lanes of a long path that an interpolated normal reflects totally. A ray that grazes a mesh of glass arrives
  /// inside at an angle that the next faces, which are a little nearer to the axis of the smooth surface, never let out
  /// again.
  [[nodiscard]] LaneMask find_trapped() const {
    const HitPacket& hit = state_.hit;
    if (state_.termination.trapped_growth == 1 || !hit.points.smooth) return 0;
    LaneMask trapped = 0;
    for_each_lane(hit.coefficients.splits & reflection_.going & ~transmission_.going, [&](int i) {
      trapped |= lane_bit(i, hit.coefficients.refracts[i] > 0 && !(hit.points.normal[i] == hit.points.face[i]));
    });
    return trapped;
  }

  /// Pushes the diffuse rays and those toward emitters.
  void spawn_diffuse(const RayQueue& rays, const ShadingPointPacket& shading_points, BounceQueues& next) {
    if (state_.template needs<&Requirements::emitters>()) diffuse_.sample_emitters(shading_points, next.emission);
    diffuse_.end_at_patches(shading_points);
    diffuse_.choose_branches(transmission_, reflection_, glossy_);
    diffuse_.aim();
    push_rays(rays, diffuse_.rays(), shading_points, diffuse_.media(), next.diffuse);
  }

  /// The ray passes straight through a surface whose medium fills neither side.
  void skip_nested_boundary(const RayQueue& rays) {
    const HitPacket& hit = state_.hit;
    const PointPacket& p = hit.points;
    for_each_lane(nested_boundary_, [&](int i) {
      const Color throughput = state_.throughput_at_hit(rays, static_cast<std::size_t>(hit.ray[i]));
      transmission_.origin.set(i, offset_origin({p.position[i], p.error[i]}, p.face[i], hit.direction[i]));
      transmission_.direction.set(i, hit.direction[i]);
      transmission_.throughput.set(i, throughput);
      transmission_.largest[i] = max_component(throughput);
      transmission_.path[i] = hit.path[i];
    });
    transmission_.going |= nested_boundary_;
  }

  /// The least throughput with which late rays of a lane survive.
  [[nodiscard]] double throughput_of_late_rays(const RayQueue& rays, int lane) {
    if (!state_.termination.late) return 0;
    double sum = 0;
    for (const SecondaryRayPacket* packet : {&transmission_, &reflection_, &glossy_, &diffuse_.rays()})
      if ((packet->going >> lane & 1) != 0) sum += packet->largest[lane];
    const Color before = state_.throughput_at_hit(rays, static_cast<std::size_t>(state_.hit.ray[lane]));
    return std::max(sum * state_.termination.growth, max_component(before));
  }

  /// Drops a ray below the cutoff, or leaves it to chance. See Termination.
  void terminate(SecondaryRayPacket& packet, std::uint64_t kind, double late, std::uint32_t sample, int lane) {
    const Termination& termination = state_.termination;
    const LaneMask bit = lane_bit(lane);
    const double largest = packet.largest[lane];
    if ((packet.going & bit) == 0 || (largest > termination.most && !(late > largest))) return;
    if (largest < termination.cutoff) {
      state_.omitted[sample] += static_cast<float>(largest);
    } else {
      const double kept = std::max(largest < termination.roulette ? termination.kept : largest, late);
      const Batch::Sample& seeds = state_.batch.samples[sample];
      const std::uint64_t choice = std::uint64_t{termination.random_path(state_.hit.path[lane])} * 2 + kind;
      const std::uint64_t random = mix(mix(seeds.key ^ mix(seeds.index)) ^ mix(~choice));
      if (static_cast<double>(random >> 11) * 0x1p-53 * kept < largest) {
        packet.throughput.set(lane, packet.throughput[lane] * (kept / largest));
        packet.largest[lane] = kept;
        return;
      }
    }
    packet.going &= ~bit;
    ++state_.statistics.cut_branches;
  }

  void terminate_at_max_depth(double largest, std::uint32_t sample) {
    ++state_.statistics.truncated_branches;
    state_.omitted[sample] += static_cast<float>(largest);
  }

  /// Environment mapping: the background replaces the secondary ray.
  void add_environment_radiance(const RayQueue& rays, const SecondaryRayPacket& packet, int lane,
                                std::uint32_t sample) {
    const double spread = has_cones() ? cone_of(rays, packet, lane).spread : 0;
    state_.radiance[sample] +=
        packet.throughput[lane] * state_.scene.background->radiance(packet.direction[lane], std::abs(spread));
  }

  [[nodiscard]] bool has_cones() const { return state_.template needs<&Requirements::filtered_textures>(); }

  [[nodiscard]] RayCone cone_of(const RayQueue& rays, const SecondaryRayPacket& packet, int lane) {
    if (&packet == &diffuse_.rays()) return {};  // not filtered
    const HitPacket& hit = state_.hit;
    const auto ray = static_cast<std::size_t>(hit.ray[lane]);
    const double t = state_.hits.t[ray];
    const double curvature =
        (hit.back_face[lane] > 0 ? -1 : 1) * curvature_at(state_.scene, state_.hits.primitive[ray]);
    if (&packet != &transmission_) return reflected_cone(rays.cone(ray), t, curvature);
    const bool refracts = hit.coefficients.refracts[lane] > 0 && (nested_boundary_ >> lane & 1) == 0;
    const double n = interfaces_.n_from[lane] / interfaces_.n_to[lane];
    return refracted_cone(rays.cone(ray), t, refracts ? curvature : 0, refracts ? n : 1);
  }

  [[nodiscard]] PathState path_state_of(const RayQueue& rays, const SecondaryRayPacket& packet, int lane) {
    if (&packet == &diffuse_.rays()) return diffuse_.path_state(lane);
    PathState state{.weight = has_diffuse() ? diffuse_.weight(lane) : 0};
    if (!has_principled()) return state;
    const PrincipledHit& hit = state_.principled[lane];
    const double own = is_black(hit.weight) ? 0 : std::min(hit.point.surface().alpha, PrincipledSurface::blurred_alpha);
    state.alpha = std::max(own, rays.path_state(static_cast<std::size_t>(state_.hit.ray[lane])).alpha);
    if (&packet == &glossy_ && state_.template needs<&Requirements::emitters>() &&
        (diffuse_.glossy_lanes() >> lane & 1) != 0)
      state.density = facets_.density[lane];
    return state;
  }

  void push_rays(const RayQueue& rays, const SecondaryRayPacket& p, const ShadingPointPacket& shading_points,
                 const MediumStack::List* media, RayQueue& to) {
    if (p.going == 0) return;
    std::size_t next = to.size(), first = next;
    to.append({p.origin, p.direction, &p.throughput, shading_points.sample, shading_points.from, p.path, media},
              p.going);
    if (has_cones()) for_each_lane(p.going, [&](int i) { to.set_cone(next++, cone_of(rays, p, i)); });
    if (has_diffuse() || has_principled())
      for_each_lane(p.going, [&](int i) { to.set_path_state(first++, path_state_of(rays, p, i)); });
  }

  WavefrontState<Features>& state_;
  LaneMask nested_boundary_ = 0;
  MediumStack::List medium_after_[lanes] = {};  ///< media beyond the surfaces
  InterfacePacket interfaces_;
  SecondaryRayPacket reflection_ = {}, transmission_ = {};
  SecondaryRayPacket glossy_ = {};  ///< rays that facets reflect
  struct {
    RandomPacket random;
    VecLanes normal;  ///< the facet's where the surface is principled, else the shading point's
    double density[lanes];
  } facets_ = {};
  DiffuseRays<Features> diffuse_;
};

}  // namespace tracer
