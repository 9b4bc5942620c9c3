#include "tracer/src/integrators/whitted/secondary_rays.h"

#include "tracer/src/math/optics.h"
#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

/// Intermediate results: shorter loops vectorize better.
struct alignas(64) ScatterGeometry {
  VecLanes normal;  ///< on the incident side
  double cos_i[lanes], cos_t[lanes];
  double reflectance[lanes];       ///< 1 in lanes without Fresnel
  double transmittance[lanes];     ///< factor of the material's transmittance; 0 at total internal reflection
  double total_reflection[lanes];  ///< 1: the transmitted part is reflected
};

/// The geometric normal on the incident side.
WHITTLE_INLINE Vec3 outward_of(const HitPacket& p, int i) { return p.points.face[i] * (1 - 2 * p.back_face[i]); }

WHITTLE_INLINE void choose_normals(const HitPacket& __restrict p, const VecLanes& __restrict normals,
                                   ScatterGeometry& __restrict m) {
  for (int i = 0; i < lanes; ++i) {
    // An interpolated normal may point away from the ray; the normal of the face never does.
    const bool toward_ray = dot(p.direction[i], normals[i]) < 0;
    m.normal.set(i, select(toward_ray, normals[i], outward_of(p, i)));
  }
}

WHITTLE_INLINE void reflect(const HitPacket& __restrict p, const ScatterGeometry& __restrict m,
                            SecondaryRayPacket& __restrict to) {
  for (int i = 0; i < lanes; ++i) to.direction.set(i, unit(reflected(p.direction[i], m.normal[i])));
}

/// Reflects rays on the wrong side of the face: inside if `side` is 1, outside if -1.
WHITTLE_INLINE void reflect_to_side(const HitPacket& __restrict p, double side, SecondaryRayPacket& __restrict to) {
  for (int i = 0; i < lanes; ++i) {
    const Vec3 direction = to.direction[i], outward = outward_of(p, i);
    const bool wrong = dot(direction, outward) * side < 0;
    to.direction.set(i, select(wrong, unit(reflected(direction, outward)), direction));
  }
}

WHITTLE_INLINE void eval_fresnel(const HitPacket& __restrict p, const InterfacePacket& __restrict n,
                                 ScatterGeometry& __restrict m) {
  for (int i = 0; i < lanes; ++i) {
    const double cosine = -dot(p.direction[i], m.normal[i]);
    const double cos_i = cosine < 1 ? cosine : 1;
    const Interface at = dielectric_interface(cos_i, n.n_from[i], n.n_to[i]);
    const bool fresnel = p.coefficients.fresnel[i] > 0, refracts = p.coefficients.refracts[i] > 0;
    const bool total = at.total_internal_reflection & (fresnel | refracts);
    const double transmittance = fresnel ? 1 - at.reflectance : 1;
    m.cos_i[i] = cos_i;
    m.cos_t[i] = at.cos_t;
    m.reflectance[i] = fresnel ? at.reflectance : 1;
    m.transmittance[i] = total ? 0 : transmittance;
    m.total_reflection[i] = total & !fresnel ? 1 : 0;
  }
}

WHITTLE_INLINE void refract(const HitPacket& __restrict p, const InterfacePacket& __restrict n,
                            const ScatterGeometry& __restrict m, SecondaryRayPacket& __restrict to) {
  for (int i = 0; i < lanes; ++i) {
    const Vec3 d = p.direction[i];
    const Vec3 bent = refracted(d, m.normal[i], m.cos_i[i], m.cos_t[i], n.n_from[i], n.n_to[i]);
    to.direction.set(i, select(p.coefficients.refracts[i] > 0, bent, d));
  }
}

/// offset_origin() with a given clearance.
WHITTLE_INLINE void clear_origins(const HitPacket& __restrict packet, const ShadingPointPacket& __restrict f,
                                  SecondaryRayPacket& __restrict to) {
  const PointPacket& p = packet.points;
  for (int i = 0; i < lanes; ++i) to.origin.set(i, clear_of(p.position[i], p.face[i], f.clearance[i], to.direction[i]));
}

WHITTLE_INLINE void scale_throughput(const HitPacket& p, int i, const Color& factor, SecondaryRayPacket& to) {
  const Color c = p.throughput[i] * factor;
  const double larger = c.r > c.g ? c.r : c.g;
  to.throughput.set(i, c);
  to.largest[i] = larger > c.b ? larger : c.b;
}

WHITTLE_INLINE void scale_throughputs(const HitPacket& __restrict p, const ScatterGeometry& __restrict m,
                                      SecondaryRayPacket& __restrict reflection,
                                      SecondaryRayPacket& __restrict transmission) {
  const CoefficientPacket& coefficients = p.coefficients;
  LaneMask reflects = 0, transmits = 0;
  for (int i = 0; i < lanes; ++i) {
    const double reflectance = m.reflectance[i], total = m.total_reflection[i], transmittance = m.transmittance[i];
    const Color transmitted = coefficients.transmittance[i];
    const Color reflected_part = coefficients.reflectance[i] * reflectance + transmitted * total;
    const Color transmitted_part = transmitted * transmittance;
    scale_throughput(p, i, reflected_part, reflection);
    scale_throughput(p, i, transmitted_part, transmission);
    reflects |= lane_bit(i, !is_black(reflected_part));
    transmits |= lane_bit(i, !is_black(transmitted_part));
  }
  reflection.going = reflects & first_lanes(p.count);
  transmission.going = transmits & first_lanes(p.count);
}

/// Reflected and transmitted rays of one hit must not make the same random choices.
WHITTLE_INLINE void hash_paths(const HitPacket& p, std::uint64_t which, SecondaryRayPacket& to) {
  for (int i = 0; i < lanes; ++i) to.path[i] = static_cast<std::uint32_t>(mix(std::uint64_t{p.path[i]} * 2 + which));
}

}  // namespace

WHITTLE_WIDE void spawn_reflection(const HitPacket& __restrict packet,
                                   const ShadingPointPacket& __restrict shading_points,
                                   SecondaryRayPacket& __restrict reflection) {
  ScatterGeometry geometry;
  choose_normals(packet, shading_points.normal, geometry);
  reflect(packet, geometry, reflection);
  reflect_to_side(packet, 1, reflection);
  clear_origins(packet, shading_points, reflection);
  for (int i = 0; i < lanes; ++i) scale_throughput(packet, i, packet.coefficients.reflectance[i], reflection);
  reflection.going = packet.coefficients.reflects & first_lanes(packet.count);
  hash_paths(packet, 0, reflection);
}

WHITTLE_WIDE void spawn_dielectric(const HitPacket& __restrict packet,
                                   const ShadingPointPacket& __restrict shading_points,
                                   const VecLanes& __restrict normals, const InterfacePacket& __restrict interfaces,
                                   bool perturbed, SecondaryRayPacket& __restrict reflection,
                                   SecondaryRayPacket& __restrict transmission) {
  ScatterGeometry geometry;
  choose_normals(packet, normals, geometry);
  eval_fresnel(packet, interfaces, geometry);
  scale_throughputs(packet, geometry, reflection, transmission);
  if (transmission.going != 0) {
    refract(packet, interfaces, geometry, transmission);
    if (perturbed) reflect_to_side(packet, -1, transmission);
    clear_origins(packet, shading_points, transmission);
    hash_paths(packet, 1, transmission);
  }
  if (reflection.going == 0) return;
  reflect(packet, geometry, reflection);
  reflect_to_side(packet, 1, reflection);
  clear_origins(packet, shading_points, reflection);
  hash_paths(packet, 0, reflection);
}

WHITTLE_WIDE LaneMask not_above(const SecondaryRayPacket& rays, double throughput) {
  LaneMask lanes_below = 0;
  for (int i = 0; i < lanes; ++i) lanes_below |= lane_bit(i, !(rays.largest[i] > throughput));
  return lanes_below & rays.going;
}

}  // namespace tracer
