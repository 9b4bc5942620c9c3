#pragma once
/// Wavefront, mirrors and glass: what goes on from a packet of hits.

#include "tracer/src/integrators/whitted/wavefront.h"

namespace tracer {

/// What lies beyond surfaces that let light through or divide it, before anything is shaded: hits on what is hidden
/// lose their weight, and with it all that they would give.
template <class Model>
void Wavefront<Model>::cross_media(const ShadingPointPacket& shading_point) {
  for_each_lane(hit_.terms.parts & first_lanes(hit_.count), [&](int i) {
    const CompiledMaterial& terms = compiled_material_of_lane(i);
    const bool back = hit_.behind[i] > 0;
    const MediumStack::List before = shading_point.media[i];
    if (!terms.transmits) {
      interfaces_.n_from[i] = media_.ior(media_.current_medium(before));
      interfaces_.n_to[i] = terms.ior;
      return;
    }
    const MediumStack::Crossing crossing = media_.cross(before, hit_.points.object[i], back);
    medium_after_[i] = crossing.after;
    // From behind, of a surface that was never entered: it has no inside, and its back counts as one.
    const bool never_entered = terms.refracts && back && crossing.after == before;
    interfaces_.n_from[i] = never_entered ? terms.ior : media_.ior(crossing.near);
    interfaces_.n_to[i] = terms.refracts ? media_.ior(crossing.far) : terms.ior;
    if (crossing.hidden && needs<&Requirements::overlapping_media>() && needs<&Requirements::refraction>())
      nested_boundary_ |= LaneMask{1} << i;
  });
  for_each_lane(nested_boundary_, [&](int i) { hit_.weight_r[i] = hit_.weight_g[i] = hit_.weight_b[i] = 0; });
}

template <class Model>
void Wavefront<Model>::branch(const RayQueue& rays, const ShadingPointPacket& shading_point, BounceQueues& next) {
  through_.going = 0;
  if (hit_.terms.parts == 0) {
    mirror(hit_, shading_point, mirrored_);
  } else {
    part(hit_, shading_point, interfaces_, needs<&Requirements::bump>(), mirrored_, through_);
    mirrored_.going &= ~nested_boundary_;
    through_.going &= ~nested_boundary_;
  }
  // Lane by lane: of hits of one sample the order in which something is added must not depend on the packet.
  const double cutoff = scene_.accuracy.cutoff;
  for_each_lane(faint(mirrored_, cutoff) | faint(through_, cutoff), [&](int i) {
    cut(through_, 1, shading_point, i);
    cut(mirrored_, 0, shading_point, i);
  });
  if (nested_boundary_ != 0) skip_nested_boundary(rays);
  const LaneMask going = mirrored_.going | through_.going;
  if (going == 0) return;
  if (next.depth > scene_.accuracy.max_depth) {
    for_each_lane(going, [&](int i) {
      for (const SecondaryRayPacket* branches : {&through_, &mirrored_})
        if ((branches->going >> i & 1) != 0) truncate(branches->largest[i], shading_point.sample[i]);
    });
  } else if (approximate().reflections == Approximations::Reflections::environment) {
    for_each_lane(going, [&](int i) {
      for (const SecondaryRayPacket* branches : {&through_, &mirrored_})
        if ((branches->going >> i & 1) != 0) add_environment_radiance(rays, *branches, i, shading_point.sample[i]);
    });
  } else {
    send(rays, through_, shading_point, medium_after_, next.refraction);
    send(rays, mirrored_, shading_point, shading_point.media, next.reflection);
  }
}

/// A surface of a solid that does not fill the place on either side is not there: the ray goes straight on.
template <class Model>
void Wavefront<Model>::skip_nested_boundary(const RayQueue& rays) {
  const PointPacket& p = hit_.points;
  for_each_lane(nested_boundary_, [&](int i) {
    const Vec3 direction{hit_.direction_x[i], hit_.direction_y[i], hit_.direction_z[i]};
    const Vec3 origin = offset_origin({{p.x[i], p.y[i], p.z[i]}, {p.error_x[i], p.error_y[i], p.error_z[i]}},
                                      {p.face_x[i], p.face_y[i], p.face_z[i]}, direction);
    through_.put(i, origin, direction, throughput_at_hit(rays, static_cast<std::size_t>(hit_.ray[i])), hit_.path[i]);
  });
  through_.going |= nested_boundary_;
}

/// Drops a lane that is too faint, or gives it the weight that it stands for.
template <class Model>
void Wavefront<Model>::cut(SecondaryRayPacket& branches, std::uint64_t which, const ShadingPointPacket& shading_point,
                           int lane) {
  const LaneMask bit = LaneMask{1} << lane;
  const double largest = branches.largest[lane];
  if ((branches.going & bit) == 0 || !(largest < scene_.accuracy.cutoff || largest == 0)) return;
  const double survival = survives(largest, shading_point.sample[lane], std::uint64_t{hit_.path[lane]} * 2 + which);
  if (!(survival > 0)) {
    branches.going &= ~bit;
    return;
  }
  const double stands_for = 1 / survival;
  for (double* channel : {branches.r, branches.g, branches.b, branches.largest}) channel[lane] *= stands_for;
}

/// The probability with which a branch of less weight than `cutoff` was kept; 0: it was not. Kept ones stand for those
/// that were not, and nothing is missing in the mean (Arvo & Kirk 1990, "Particle Transport and Image Synthesis").
template <class Model>
double Wavefront<Model>::survives(double most, std::uint32_t sample, std::uint64_t bounce) {
  if (scene_.accuracy.cutoff_by_chance && most > 0) {
    const Batch::Sample& choices = batch_.samples[sample];
    const std::uint64_t chance = mix(mix(choices.key ^ mix(choices.index)) ^ mix(~bounce));
    const double survival = most / scene_.accuracy.cutoff;
    if (static_cast<double>(chance >> 11) * 0x1p-53 < survival) return survival;
  } else {
    omitted_[sample].cutoff += static_cast<float>(most);
  }
  ++statistics_.cut_branches;
  return 0;
}

/// A branch that `max_depth` ends.
template <class Model>
void Wavefront<Model>::truncate(double largest, std::uint32_t sample) {
  ++statistics_.truncated_branches;
  omitted_[sample].depth += static_cast<float>(largest);
}

/// In place of tracing a branch.
template <class Model>
void Wavefront<Model>::add_environment_radiance(const RayQueue& rays, const SecondaryRayPacket& branches, int lane,
                                                std::uint32_t sample) {
  const double spread = needs<&Requirements::filtered_textures>() ? cone_of(rays, branches, lane).spread : 0;
  radiance_[sample] +=
      branches.throughput(lane) * scene_.background->radiance(branches.direction(lane), std::abs(spread));
}

template <class Model>
RayCone Wavefront<Model>::cone_of(const RayQueue& rays, const SecondaryRayPacket& branches, int lane) const {
  const auto ray = static_cast<std::size_t>(hit_.ray[lane]);
  const double curvature = (hit_.behind[lane] > 0 ? -1 : 1) * curvature_at(scene_, hits_.primitive[ray]);
  if (&branches == &mirrored_) return tracer::mirrored(rays.cone(ray), hits_.t[ray], curvature);
  const bool refracts = hit_.terms.refracts[lane] > 0 && (nested_boundary_ >> lane & 1) == 0;
  const double n = interfaces_.n_from[lane] / interfaces_.n_to[lane];
  return tracer::refracted(rays.cone(ray), hits_.t[ray], refracts ? curvature : 0, refracts ? n : 1);
}

template <class Model>
void Wavefront<Model>::send(const RayQueue& rays, const SecondaryRayPacket& b, const ShadingPointPacket& shading_point,
                            const MediumStack::List* media, RayQueue& to) {
  if (b.going == 0) return;
  std::size_t sent = to.size();
  to.append(
      {b.ox, b.oy, b.oz, b.dx, b.dy, b.dz, b.r, b.g, b.b, shading_point.sample, shading_point.from, b.path, media},
      b.going);
  if (needs<&Requirements::filtered_textures>())
    for_each_lane(b.going, [&](int i) { to.widen(sent++, cone_of(rays, b, i)); });
}

}  // namespace tracer
