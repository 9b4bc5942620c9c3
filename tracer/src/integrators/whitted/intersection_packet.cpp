#include "tracer/src/integrators/whitted/intersection_packet.h"

#include <cstring>

namespace tracer {
namespace {

template <class Value>
WHITTLE_INLINE void pick(const Value* __restrict from, const int* __restrict index, Value* __restrict to) {
  if (index[lanes - 1] - index[0] == lanes - 1) {             // ascending, so contiguous
    std::memcpy(to, from + index[0], lanes * sizeof(Value));  // inline vector code; a loop becomes a call
  } else {
    for (int i = 0; i < lanes; ++i) to[i] = from[index[i]];
  }
}

WHITTLE_INLINE void load_intersections(const RaySpan& rays, const HitSpan& hits, const std::uint32_t* ray, int count,
                                       IntersectionPacket& p) {
  p.count = count;
  for (int i = 0; i < lanes; ++i) p.ray[i] = static_cast<int>(ray[i < count ? i : 0]);
  VecLanes origin;
  alignas(64) double distance[lanes];
  pick(rays.ox, p.ray, origin.x);
  pick(rays.oy, p.ray, origin.y);
  pick(rays.oz, p.ray, origin.z);
  pick(rays.dx, p.ray, p.direction.x);
  pick(rays.dy, p.ray, p.direction.y);
  pick(rays.dz, p.ray, p.direction.z);
  pick(hits.t, p.ray, distance);
  for (int i = 0; i < lanes; ++i) p.ray_hits.on_ray.set(i, origin[i] + p.direction[i] * distance[i]);
  pick(hits.u, p.ray, p.ray_hits.u);
  pick(hits.v, p.ray, p.ray_hits.v);
  pick(hits.primitive, p.ray, p.ray_hits.primitive);
}

WHITTLE_INLINE void put(const CompiledMaterial& material, int i, CoefficientPacket& to) {
  to.emitted_ambient.set(i, material.emitted_ambient);
  to.diffuse.set(i, material.diffuse);
  to.specular.set(i, material.specular);
  to.reflectance.set(i, material.reflectance);
  to.shininess[i] = material.shininess;
  to.blinn[i] = material.blinn ? 1 : 0;
}

WHITTLE_INLINE void put_split(const CompiledMaterial& material, int i, CoefficientPacket& to) {
  to.transmittance.set(i, material.transmittance);
  to.refracts[i] = material.refracts ? 1 : 0;
  to.fresnel[i] = material.fresnel ? 1 : 0;
}

WHITTLE_INLINE void set_flags(const CompiledMaterial& material, int i, CoefficientPacket& to) {
  const bool has_specular = !is_black(material.specular);
  to.any_specular |= has_specular;
  to.any_blinn |= has_specular && material.blinn;
  to.any_emitted |= material.textured || !is_black(material.emitted_ambient);
  to.textured |= lane_bit(i, material.textured);
  to.any_normal_map |= material.has_normal_map;
  to.reflects |= lane_bit(i, !is_black(material.reflectance));
  to.splits |= lane_bit(i, material.splits);
}

WHITTLE_INLINE bool differ(const std::uint32_t* a, const std::uint32_t* b) {
  std::uint32_t difference = 0;
  for (int i = 0; i < lanes; ++i) difference |= a[i] ^ b[i];
  return difference != 0;
}

WHITTLE_INLINE void multiply(const ColorLanes& __restrict throughput, const ColorLanes& __restrict factor,
                             ColorLanes& __restrict to) {
  for (int i = 0; i < lanes; ++i) to.set(i, throughput[i] * factor[i]);
}

}  // namespace

WHITTLE_WIDE void load(const RayQueue& rays, const HitSpan& hits, const std::uint32_t* ray, int count,
                       IntersectionPacket& packet) {
  load_intersections(rays.span(), hits, ray, count, packet);
}

WHITTLE_WIDE void load(const RayQueue& rays, const HitSpan& hits, const std::uint32_t* ray, int count, HitPacket& p,
                       ShadingPointPacket& f) {
  load_intersections(rays.span(), hits, ray, count, p);
  f.count = count;
  const RayQueue::Payload payload = rays.payload();
  pick(hits.primitive, p.ray, f.from);
  pick(payload.r, p.ray, p.throughput.r);
  pick(payload.g, p.ray, p.throughput.g);
  pick(payload.b, p.ray, p.throughput.b);
  pick(payload.path, p.ray, p.path);
  pick(payload.sample, p.ray, f.sample);
  pick(payload.media, p.ray, f.media);
}

WHITTLE_WIDE void orient_normals(HitPacket& packet, ShadingPointPacket& f) {
  const PointPacket& p = packet.points;
  for (int i = 0; i < lanes; ++i) {
    const Vec3 direction = packet.direction[i], face = p.face[i];
    const double sign = dot(direction, face) > 0 ? -1 : 1;
    packet.back_face[i] = sign < 0 ? 1 : 0;
    f.face.set(i, face);
    f.normal.set(i, face * sign);
    f.to_eye.set(i, -direction);
  }
  for (int i = 0; i < lanes; ++i) {
    f.position.set(i, p.position[i]);
    f.clearance[i] = clearance({p.position[i], p.error[i]}, p.face[i]);
  }
  f.smooth = p.smooth;
  if (!p.smooth) return;
  for (int i = 0; i < lanes; ++i) {
    const bool front = packet.back_face[i] == 0;
    f.normal.set(i, p.normal[i] * (front ? 1.0 : -1.0));
    // At a back-face hit the curved surface is on the other side of the facet: no offset is needed.
    f.shadow_offset.set(i, select(front, p.offset[i], {}));
  }
}

void gather_coefficients(const std::vector<CompiledMaterial>& materials, HitPacket& packet) {
  CoefficientPacket& gathered = packet.coefficients;
  if (!differ(packet.material, gathered.material)) return;
  gathered.any_specular = gathered.any_blinn = gathered.any_emitted = false;
  gathered.any_normal_map = false;
  gathered.reflects = gathered.splits = gathered.textured = 0;
  for (int i = 0; i < lanes; ++i) {
    const CompiledMaterial& material = materials[packet.material[i]];
    put(material, i, gathered);
    set_flags(material, i, gathered);
  }
  for (int i = 0; gathered.splits != 0 && i < lanes; ++i) put_split(materials[packet.material[i]], i, gathered);
  std::copy_n(packet.material, lanes, gathered.material);
}

void gather_far_side(const std::vector<CompiledMaterial>& materials, HitPacket& packet) {
  CoefficientPacket& gathered = packet.coefficients;
  gathered.transmits_light = 0;
  for (int i = 0; i < lanes; ++i) {
    const CompiledMaterial& material = materials[packet.material[i]];
    gathered.transmits_light |= lane_bit(i, material.transmits_light);
    gathered.set_far_side(i, material);
  }
}

WHITTLE_WIDE void apply_throughput(HitPacket& p, ShadingPointPacket& f) {
  const CoefficientPacket& c = p.coefficients;
  f.any_specular = c.any_specular;
  f.any_blinn = c.any_blinn;
  multiply(p.throughput, c.diffuse, f.diffuse);
  if (f.any_specular) {
    multiply(p.throughput, c.specular, f.specular);
    for (int i = 0; i < lanes; ++i) {
      f.shininess[i] = c.shininess[i];
      f.specular_model[i] = is_black(f.specular[i]) ? 0 : 1 + c.blinn[i];
    }
  }
  multiply(p.throughput, c.emitted_ambient, p.emitted);
}

void set_textured_coefficients(const Coefficients& coefficients, int lane, HitPacket& packet,
                               ShadingPointPacket& shading_points) {
  const Color throughput = packet.throughput[lane];
  packet.emitted.set(lane, throughput * coefficients.emitted_ambient);
  shading_points.diffuse.set(lane, throughput * coefficients.diffuse);
  if (shading_points.any_specular) {
    shading_points.specular.set(lane, throughput * coefficients.specular);
    shading_points.specular_model[lane] =
        is_black(shading_points.specular[lane]) ? 0 : 1 + packet.coefficients.blinn[lane];
  }
  CoefficientPacket& gathered = packet.coefficients;
  gathered.reflectance.set(lane, coefficients.reflectance);
  gathered.reflects &= ~lane_bit(lane);
  gathered.reflects |= lane_bit(lane, !is_black(coefficients.reflectance));
  if (gathered.splits != 0) gathered.transmittance.set(lane, coefficients.transmittance);
  if (gathered.transmits_light != 0) gathered.set_far_side(lane, coefficients);
}

}  // namespace tracer
