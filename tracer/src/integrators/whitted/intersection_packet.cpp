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

/// Computes the points at distance t along the rays.
WHITTLE_INLINE void compute_ray_points(const RaySpan& rays, const double* t, IntersectionPacket& p) {
  alignas(64) double x[lanes], y[lanes], z[lanes], distance[lanes];
  pick(rays.ox, p.ray, x);
  pick(rays.oy, p.ray, y);
  pick(rays.oz, p.ray, z);
  pick(t, p.ray, distance);
  for (int i = 0; i < lanes; ++i) {
    p.ray_hits.on_x[i] = x[i] + p.direction_x[i] * distance[i];
    p.ray_hits.on_y[i] = y[i] + p.direction_y[i] * distance[i];
    p.ray_hits.on_z[i] = z[i] + p.direction_z[i] * distance[i];
  }
}

WHITTLE_INLINE void load_intersections(const RaySpan& rays, const HitSpan& hits, const std::uint32_t* ray, int count,
                                       IntersectionPacket& p) {
  p.count = count;
  for (int i = 0; i < lanes; ++i) p.ray[i] = static_cast<int>(ray[i < count ? i : 0]);
  pick(rays.dx, p.ray, p.direction_x);
  pick(rays.dy, p.ray, p.direction_y);
  pick(rays.dz, p.ray, p.direction_z);
  compute_ray_points(rays, hits.t, p);
  pick(hits.u, p.ray, p.ray_hits.u);
  pick(hits.v, p.ray, p.ray_hits.v);
  pick(hits.primitive, p.ray, p.ray_hits.primitive);
}

WHITTLE_INLINE void put(const Color& color, int i, double (&to)[3][lanes]) {
  to[0][i] = color.r;
  to[1][i] = color.g;
  to[2][i] = color.b;
}

WHITTLE_INLINE void put(const CompiledMaterial& material, int i, CoefficientPacket& to) {
  put(material.own, i, to.emitted_ambient);
  put(material.diffuse, i, to.diffuse);
  put(material.specular, i, to.specular);
  put(material.mirror, i, to.reflectance);
  to.shininess[i] = material.shininess;
  to.blinn[i] = material.blinn ? 1 : 0;
}

WHITTLE_INLINE void put_split(const CompiledMaterial& material, int i, CoefficientPacket& to) {
  put(material.through, i, to.transmittance);
  to.refracts[i] = material.refracts ? 1 : 0;
  to.fresnel[i] = material.fresnel ? 1 : 0;
}

WHITTLE_INLINE void set_flags(const CompiledMaterial& material, int i, CoefficientPacket& to) {
  const bool has_specular = !is_black(material.specular);
  to.any_specular |= has_specular;
  to.any_blinn |= has_specular && material.blinn;
  to.any_emitted |= material.textured || !is_black(material.own);
  to.textured |= material.textured ? LaneMask{1} << i : 0;
  to.any_normal_map |= material.has_normal_map;
  to.reflects |= is_black(material.mirror) ? 0 : LaneMask{1} << i;
  to.splits |= material.transmits || material.fresnel ? LaneMask{1} << i : 0;
}

WHITTLE_INLINE bool differ(const std::uint32_t* a, const std::uint32_t* b) {
  std::uint32_t difference = 0;
  for (int i = 0; i < lanes; ++i) difference |= a[i] ^ b[i];
  return difference != 0;
}

WHITTLE_INLINE void times(const double* __restrict throughput, const double* __restrict factor, double* __restrict to) {
  for (int i = 0; i < lanes; ++i) to[i] = throughput[i] * factor[i];
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
  pick(payload.r, p.ray, p.throughput_r);
  pick(payload.g, p.ray, p.throughput_g);
  pick(payload.b, p.ray, p.throughput_b);
  pick(payload.path, p.ray, p.path);
  pick(payload.sample, p.ray, f.sample);
  pick(payload.media, p.ray, f.media);
}

WHITTLE_WIDE void orient_normals(HitPacket& packet, ShadingPointPacket& f) {
  const PointPacket& p = packet.points;
  for (int i = 0; i < lanes; ++i) {
    const double x = packet.direction_x[i], y = packet.direction_y[i], z = packet.direction_z[i];
    const double sign = x * p.face_x[i] + y * p.face_y[i] + z * p.face_z[i] > 0 ? -1 : 1;
    packet.back_face[i] = sign < 0 ? 1 : 0;
    f.face_x[i] = p.face_x[i];
    f.face_y[i] = p.face_y[i];
    f.face_z[i] = p.face_z[i];
    f.normal_x[i] = p.face_x[i] * sign;
    f.normal_y[i] = p.face_y[i] * sign;
    f.normal_z[i] = p.face_z[i] * sign;
    f.eye_x[i] = -x;
    f.eye_y[i] = -y;
    f.eye_z[i] = -z;
  }
  for (int i = 0; i < lanes; ++i) {
    f.x[i] = p.x[i];
    f.y[i] = p.y[i];
    f.z[i] = p.z[i];
    f.clearance[i] = std::abs(p.face_x[i]) * p.error_x[i] + std::abs(p.face_y[i]) * p.error_y[i] +
                     std::abs(p.face_z[i]) * p.error_z[i];
  }
  if (!p.smooth) return;
  for (int i = 0; i < lanes; ++i) {
    const bool front = packet.back_face[i] == 0;
    const double sign = front ? 1 : -1;
    f.normal_x[i] = p.normal_x[i] * sign;
    f.normal_y[i] = p.normal_y[i] * sign;
    f.normal_z[i] = p.normal_z[i] * sign;
    // At a back-face hit the curved surface is on the other side of the facet: no offset is needed.
    f.x[i] = front ? p.x[i] + p.offset_x[i] : p.x[i];
    f.y[i] = front ? p.y[i] + p.offset_y[i] : p.y[i];
    f.z[i] = front ? p.z[i] + p.offset_z[i] : p.z[i];
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

WHITTLE_WIDE void apply_throughput(HitPacket& p, ShadingPointPacket& f) {
  const CoefficientPacket& c = p.coefficients;
  f.any_specular = c.any_specular;
  f.any_blinn = c.any_blinn;
  times(p.throughput_r, c.diffuse[0], f.diffuse_r);
  times(p.throughput_g, c.diffuse[1], f.diffuse_g);
  times(p.throughput_b, c.diffuse[2], f.diffuse_b);
  if (f.any_specular) {
    times(p.throughput_r, c.specular[0], f.specular_r);
    times(p.throughput_g, c.specular[1], f.specular_g);
    times(p.throughput_b, c.specular[2], f.specular_b);
    for (int i = 0; i < lanes; ++i) {
      f.shininess[i] = c.shininess[i];
      f.blinn[i] = c.blinn[i];
      const bool black = (f.specular_r[i] == 0) & (f.specular_g[i] == 0) & (f.specular_b[i] == 0);
      f.has_specular[i] = black ? 0 : 1;
    }
  }
  times(p.throughput_r, c.emitted_ambient[0], p.emitted_r);
  times(p.throughput_g, c.emitted_ambient[1], p.emitted_g);
  times(p.throughput_b, c.emitted_ambient[2], p.emitted_b);
}

void set_textured_color(const Color& emitted, const Color& diffuse, int lane, HitPacket& packet,
                        ShadingPointPacket& shading_points) {
  const Color throughput = packet.throughput(lane), emitted_here = throughput * emitted,
              diffuse_here = throughput * diffuse;
  packet.emitted_r[lane] = emitted_here.r;
  packet.emitted_g[lane] = emitted_here.g;
  packet.emitted_b[lane] = emitted_here.b;
  shading_points.diffuse_r[lane] = diffuse_here.r;
  shading_points.diffuse_g[lane] = diffuse_here.g;
  shading_points.diffuse_b[lane] = diffuse_here.b;
}

}  // namespace tracer
