#include "tracer/src/integrators/whitted/secondary_ray_packet.h"

#include "tracer/src/math/optics.h"
#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

/// Intermediate results: shorter loops vectorize better.
struct alignas(64) ScatterGeometry {
  double normal_x[lanes], normal_y[lanes], normal_z[lanes];  ///< on the incident side
  double cos_i[lanes], cos_t[lanes];
  double reflectance[lanes];       ///< 1 in lanes without Fresnel
  double transmittance[lanes];     ///< factor of the material's transmittance; 0 at total internal reflection
  double total_reflection[lanes];  ///< 1: the transmitted part is reflected
};

WHITTLE_INLINE Vec3 direction_of(const HitPacket& p, int i) {
  return {p.direction_x[i], p.direction_y[i], p.direction_z[i]};
}

/// The geometric normal on the incident side.
WHITTLE_INLINE Vec3 outward_of(const HitPacket& p, int i) {
  const double sign = 1 - 2 * p.back_face[i];
  return {p.points.face_x[i] * sign, p.points.face_y[i] * sign, p.points.face_z[i] * sign};
}

WHITTLE_INLINE void choose_normals(const HitPacket& __restrict p, const ShadingPointPacket& __restrict f,
                                   ScatterGeometry& __restrict m) {
  for (int i = 0; i < lanes; ++i) {
    const Vec3 d = direction_of(p, i), outward = outward_of(p, i);
    // An interpolated normal may point away from the ray; the normal of the face never does.
    const bool toward_ray = d.x * f.normal_x[i] + d.y * f.normal_y[i] + d.z * f.normal_z[i] < 0;
    m.normal_x[i] = toward_ray ? f.normal_x[i] : outward.x;
    m.normal_y[i] = toward_ray ? f.normal_y[i] : outward.y;
    m.normal_z[i] = toward_ray ? f.normal_z[i] : outward.z;
  }
}

WHITTLE_INLINE void reflect(const HitPacket& __restrict p, const ScatterGeometry& __restrict m,
                            SecondaryRayPacket& __restrict to) {
  for (int i = 0; i < lanes; ++i) {
    const Vec3 direction = unit(reflected(direction_of(p, i), {m.normal_x[i], m.normal_y[i], m.normal_z[i]}));
    to.dx[i] = direction.x;
    to.dy[i] = direction.y;
    to.dz[i] = direction.z;
  }
}

/// Reflects rays on the wrong side of the face: inside if `side` is 1, outside if -1.
WHITTLE_INLINE void reflect_to_side(const HitPacket& __restrict p, double side, SecondaryRayPacket& __restrict to) {
  for (int i = 0; i < lanes; ++i) {
    const Vec3 direction{to.dx[i], to.dy[i], to.dz[i]}, outward = outward_of(p, i);
    const Vec3 again = unit(reflected(direction, outward));
    const bool wrong = (direction.x * outward.x + direction.y * outward.y + direction.z * outward.z) * side < 0;
    to.dx[i] = wrong ? again.x : direction.x;
    to.dy[i] = wrong ? again.y : direction.y;
    to.dz[i] = wrong ? again.z : direction.z;
  }
}

WHITTLE_INLINE void eval_fresnel(const HitPacket& __restrict p, const InterfacePacket& __restrict n,
                                 ScatterGeometry& __restrict m) {
  for (int i = 0; i < lanes; ++i) {
    const double cosine =
        -(p.direction_x[i] * m.normal_x[i] + p.direction_y[i] * m.normal_y[i] + p.direction_z[i] * m.normal_z[i]);
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
    const Vec3 d = direction_of(p, i);
    const Vec3 bent =
        refracted(d, {m.normal_x[i], m.normal_y[i], m.normal_z[i]}, m.cos_i[i], m.cos_t[i], n.n_from[i], n.n_to[i]);
    const bool refracts = p.coefficients.refracts[i] > 0;
    to.dx[i] = refracts ? bent.x : d.x;
    to.dy[i] = refracts ? bent.y : d.y;
    to.dz[i] = refracts ? bent.z : d.z;
  }
}

/// offset_origin() with a given clearance.
WHITTLE_INLINE void offset_origins(const HitPacket& __restrict packet, const ShadingPointPacket& __restrict f,
                                   SecondaryRayPacket& __restrict to) {
  const PointPacket& p = packet.points;
  for (int i = 0; i < lanes; ++i) {
    const Vec3 origin = clear_of({p.x[i], p.y[i], p.z[i]}, {p.face_x[i], p.face_y[i], p.face_z[i]}, f.clearance[i],
                                 {to.dx[i], to.dy[i], to.dz[i]});
    to.ox[i] = origin.x;
    to.oy[i] = origin.y;
    to.oz[i] = origin.z;
  }
}

WHITTLE_INLINE void scale_throughput(const HitPacket& p, int i, const Color& factor, SecondaryRayPacket& to) {
  const double r = p.throughput_r[i] * factor.r, g = p.throughput_g[i] * factor.g, b = p.throughput_b[i] * factor.b;
  const double larger = r > g ? r : g;
  to.r[i] = r;
  to.g[i] = g;
  to.b[i] = b;
  to.largest[i] = larger > b ? larger : b;
}

WHITTLE_INLINE LaneMask bit_unless_black(const Color& factor, int i) {
  return (factor.r == 0) & (factor.g == 0) & (factor.b == 0) ? 0 : LaneMask{1} << i;
}

WHITTLE_INLINE void scale_throughputs(const HitPacket& __restrict p, const ScatterGeometry& __restrict m,
                                      SecondaryRayPacket& __restrict reflection,
                                      SecondaryRayPacket& __restrict transmission) {
  const CoefficientPacket& coefficients = p.coefficients;
  LaneMask reflects = 0, transmits = 0;
  for (int i = 0; i < lanes; ++i) {
    const double reflectance = m.reflectance[i], total = m.total_reflection[i], transmittance = m.transmittance[i];
    const Color reflected_part{coefficients.reflectance[0][i] * reflectance + coefficients.transmittance[0][i] * total,
                               coefficients.reflectance[1][i] * reflectance + coefficients.transmittance[1][i] * total,
                               coefficients.reflectance[2][i] * reflectance + coefficients.transmittance[2][i] * total};
    const Color transmitted_part{coefficients.transmittance[0][i] * transmittance,
                                 coefficients.transmittance[1][i] * transmittance,
                                 coefficients.transmittance[2][i] * transmittance};
    scale_throughput(p, i, reflected_part, reflection);
    scale_throughput(p, i, transmitted_part, transmission);
    reflects |= bit_unless_black(reflected_part, i);
    transmits |= bit_unless_black(transmitted_part, i);
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
  choose_normals(packet, shading_points, geometry);
  reflect(packet, geometry, reflection);
  reflect_to_side(packet, 1, reflection);
  offset_origins(packet, shading_points, reflection);
  const auto& factor = packet.coefficients.reflectance;
  for (int i = 0; i < lanes; ++i) scale_throughput(packet, i, {factor[0][i], factor[1][i], factor[2][i]}, reflection);
  reflection.going = packet.coefficients.reflects & first_lanes(packet.count);
  hash_paths(packet, 0, reflection);
}

WHITTLE_WIDE void spawn_dielectric(const HitPacket& __restrict packet,
                                   const ShadingPointPacket& __restrict shading_points,
                                   const InterfacePacket& __restrict interfaces, bool perturbed,
                                   SecondaryRayPacket& __restrict reflection,
                                   SecondaryRayPacket& __restrict transmission) {
  ScatterGeometry geometry;
  choose_normals(packet, shading_points, geometry);
  eval_fresnel(packet, interfaces, geometry);
  scale_throughputs(packet, geometry, reflection, transmission);
  if (transmission.going != 0) {
    refract(packet, interfaces, geometry, transmission);
    if (perturbed) reflect_to_side(packet, -1, transmission);
    offset_origins(packet, shading_points, transmission);
    hash_paths(packet, 1, transmission);
  }
  if (reflection.going == 0) return;
  reflect(packet, geometry, reflection);
  reflect_to_side(packet, 1, reflection);
  offset_origins(packet, shading_points, reflection);
  hash_paths(packet, 0, reflection);
}

WHITTLE_WIDE LaneMask below_cutoff(const SecondaryRayPacket& rays, double cutoff) {
  LaneMask lanes_below = 0;
  for (int i = 0; i < lanes; ++i)
    lanes_below |= (rays.largest[i] < cutoff) | (rays.largest[i] == 0) ? LaneMask{1} << i : 0;
  return lanes_below & rays.going;
}

}  // namespace tracer
