#include "tracer/src/integrators/whitted/intersection_packet.h"

#include <cstring>

namespace tracer {
namespace {

template <class Value>
WHITTLE_INLINE void pick(const Value* __restrict from, const int* __restrict index, Value* __restrict to) {
  if (index[lanes - 1] - index[0] == lanes - 1) {             // ascending, so next to each other
    std::memcpy(to, from + index[0], lanes * sizeof(Value));  // as vectors; of a loop a call would be made
  } else {
    for (int i = 0; i < lanes; ++i) to[i] = from[index[i]];
  }
}

/// Where the rays' arithmetic has the hits.
WHITTLE_INLINE void step_along(const RaySpan& rays, const double* t, IntersectionPacket& p) {
  alignas(64) double x[lanes], y[lanes], z[lanes], distance[lanes];
  pick(rays.ox, p.ray, x);
  pick(rays.oy, p.ray, y);
  pick(rays.oz, p.ray, z);
  pick(t, p.ray, distance);
  for (int i = 0; i < lanes; ++i) {
    p.met.on_x[i] = x[i] + p.direction_x[i] * distance[i];
    p.met.on_y[i] = y[i] + p.direction_y[i] * distance[i];
    p.met.on_z[i] = z[i] + p.direction_z[i] * distance[i];
  }
}

WHITTLE_INLINE void load_places(const RaySpan& rays, const HitSpan& hits, const std::uint32_t* ray, int count,
                                IntersectionPacket& p) {
  p.count = count;
  for (int i = 0; i < lanes; ++i) p.ray[i] = static_cast<int>(ray[i < count ? i : 0]);
  pick(rays.dx, p.ray, p.direction_x);
  pick(rays.dy, p.ray, p.direction_y);
  pick(rays.dz, p.ray, p.direction_z);
  step_along(rays, hits.t, p);
  pick(hits.u, p.ray, p.met.u);
  pick(hits.v, p.ray, p.met.v);
  pick(hits.primitive, p.ray, p.met.primitive);
}

WHITTLE_INLINE void put(const Color& color, int i, double (&to)[3][lanes]) {
  to[0][i] = color.r;
  to[1][i] = color.g;
  to[2][i] = color.b;
}

WHITTLE_INLINE void put(const CompiledMaterial& terms, int i, CoefficientPacket& to) {
  put(terms.own, i, to.own);
  put(terms.diffuse, i, to.diffuse);
  put(terms.specular, i, to.specular);
  put(terms.mirror, i, to.mirror);
  to.shininess[i] = terms.shininess;
  to.blinn[i] = terms.blinn ? 1 : 0;
}

WHITTLE_INLINE void put_parting(const CompiledMaterial& terms, int i, CoefficientPacket& to) {
  put(terms.through, i, to.through);
  to.refracts[i] = terms.refracts ? 1 : 0;
  to.fresnel[i] = terms.fresnel ? 1 : 0;
}

WHITTLE_INLINE void note(const CompiledMaterial& terms, int i, CoefficientPacket& to) {
  const bool has_specular = !is_black(terms.specular);
  to.any_shines |= has_specular;
  to.any_halfway |= has_specular && terms.blinn;
  to.any_own |= terms.textured || !is_black(terms.own);
  to.textured |= terms.textured ? LaneMask{1} << i : 0;
  to.any_bends |= terms.has_normal_map;
  to.mirrors |= is_black(terms.mirror) ? 0 : LaneMask{1} << i;
  to.parts |= terms.transmits || terms.fresnel ? LaneMask{1} << i : 0;
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
  load_places(rays.span(), hits, ray, count, packet);
}

WHITTLE_WIDE void load(const RayQueue& rays, const HitSpan& hits, const std::uint32_t* ray, int count, HitPacket& p,
                       ShadingPointPacket& f) {
  load_places(rays.span(), hits, ray, count, p);
  f.count = count;
  const RayQueue::Carried carried = rays.carried();
  pick(hits.primitive, p.ray, f.from);
  pick(carried.r, p.ray, p.weight_r);
  pick(carried.g, p.ray, p.weight_g);
  pick(carried.b, p.ray, p.weight_b);
  pick(carried.path, p.ray, p.path);
  pick(carried.sample, p.ray, f.sample);
  pick(carried.media, p.ray, f.media);
}

WHITTLE_WIDE void face(HitPacket& packet, ShadingPointPacket& f) {
  const PointPacket& p = packet.points;
  for (int i = 0; i < lanes; ++i) {
    const double x = packet.direction_x[i], y = packet.direction_y[i], z = packet.direction_z[i];
    const double turned = x * p.face_x[i] + y * p.face_y[i] + z * p.face_z[i] > 0 ? -1 : 1;
    packet.behind[i] = turned < 0 ? 1 : 0;
    f.face_x[i] = p.face_x[i];
    f.face_y[i] = p.face_y[i];
    f.face_z[i] = p.face_z[i];
    f.normal_x[i] = p.face_x[i] * turned;
    f.normal_y[i] = p.face_y[i] * turned;
    f.normal_z[i] = p.face_z[i] * turned;
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
    const bool front = packet.behind[i] == 0;
    const double turned = front ? 1 : -1;
    f.normal_x[i] = p.normal_x[i] * turned;
    f.normal_y[i] = p.normal_y[i] * turned;
    f.normal_z[i] = p.normal_z[i] * turned;
    // Seen from behind the curved surface is on the other side of the facet: nothing to correct there.
    f.x[i] = front ? p.x[i] + p.offset_x[i] : p.x[i];
    f.y[i] = front ? p.y[i] + p.offset_y[i] : p.y[i];
    f.z[i] = front ? p.z[i] + p.offset_z[i] : p.z[i];
  }
}

void take_materials(const std::vector<CompiledMaterial>& terms, HitPacket& packet) {
  CoefficientPacket& taken = packet.terms;
  if (!differ(packet.material, taken.material)) return;
  taken.any_shines = taken.any_halfway = taken.any_own = false;
  taken.any_bends = false;
  taken.mirrors = taken.parts = taken.textured = 0;
  for (int i = 0; i < lanes; ++i) {
    const CompiledMaterial& of = terms[packet.material[i]];
    put(of, i, taken);
    note(of, i, taken);
  }
  for (int i = 0; taken.parts != 0 && i < lanes; ++i) put_parting(terms[packet.material[i]], i, taken);
  std::copy_n(packet.material, lanes, taken.material);
}

WHITTLE_WIDE void weigh(HitPacket& p, ShadingPointPacket& f) {
  const CoefficientPacket& terms = p.terms;
  f.any_shines = terms.any_shines;
  f.any_halfway = terms.any_halfway;
  times(p.weight_r, terms.diffuse[0], f.diffuse_r);
  times(p.weight_g, terms.diffuse[1], f.diffuse_g);
  times(p.weight_b, terms.diffuse[2], f.diffuse_b);
  if (f.any_shines) {
    times(p.weight_r, terms.specular[0], f.specular_r);
    times(p.weight_g, terms.specular[1], f.specular_g);
    times(p.weight_b, terms.specular[2], f.specular_b);
    for (int i = 0; i < lanes; ++i) {
      f.shininess[i] = terms.shininess[i];
      f.blinn[i] = terms.blinn[i];
      const bool black = (f.specular_r[i] == 0) & (f.specular_g[i] == 0) & (f.specular_b[i] == 0);
      f.has_specular[i] = black ? 0 : 1;
    }
  }
  times(p.weight_r, terms.own[0], p.own_r);
  times(p.weight_g, terms.own[1], p.own_g);
  times(p.weight_b, terms.own[2], p.own_b);
}

void take_color(const Color& own, const Color& diffuse, int lane, HitPacket& packet,
                ShadingPointPacket& shading_point) {
  const Color throughput = packet.throughput(lane), own_here = throughput * own, diffuse_here = throughput * diffuse;
  packet.own_r[lane] = own_here.r;
  packet.own_g[lane] = own_here.g;
  packet.own_b[lane] = own_here.b;
  shading_point.diffuse_r[lane] = diffuse_here.r;
  shading_point.diffuse_g[lane] = diffuse_here.g;
  shading_point.diffuse_b[lane] = diffuse_here.b;
}

}  // namespace tracer
