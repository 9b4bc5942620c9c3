#include "tracer/src/integrators/whitted/secondary_ray_packet.h"

#include "tracer/src/math/optics.h"
#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

/// Between the steps: loops that do less become better vector code.
struct alignas(64) Meeting {
  double normal_x[lanes], normal_y[lanes], normal_z[lanes];  ///< on the ray's side
  double cos_i[lanes], cos_t[lanes];
  double reflectance[lanes];  ///< 1 where Fresnel does not divide
  double passing[lanes];      ///< what is multiplied by `through`; 0 at total internal reflection
  double returning[lanes];    ///< 1: what would go through is mirrored
};

WHITTLE_INLINE Vec3 direction_of(const HitPacket& p, int i) {
  return {p.direction_x[i], p.direction_y[i], p.direction_z[i]};
}

/// The geometric normal on the ray's side.
WHITTLE_INLINE Vec3 outward_of(const HitPacket& p, int i) {
  const double turned = 1 - 2 * p.behind[i];
  return {p.points.face_x[i] * turned, p.points.face_y[i] * turned, p.points.face_z[i] * turned};
}

WHITTLE_INLINE void find_normals(const HitPacket& __restrict p, const ShadingPointPacket& __restrict f,
                                 Meeting& __restrict m) {
  for (int i = 0; i < lanes; ++i) {
    const Vec3 d = direction_of(p, i), outward = outward_of(p, i);
    // An interpolated normal may face away from the ray; the face's never does.
    const bool seen = d.x * f.normal_x[i] + d.y * f.normal_y[i] + d.z * f.normal_z[i] < 0;
    m.normal_x[i] = seen ? f.normal_x[i] : outward.x;
    m.normal_y[i] = seen ? f.normal_y[i] : outward.y;
    m.normal_z[i] = seen ? f.normal_z[i] : outward.z;
  }
}

WHITTLE_INLINE void reflect(const HitPacket& __restrict p, const Meeting& __restrict m,
                            SecondaryRayPacket& __restrict to) {
  for (int i = 0; i < lanes; ++i) {
    const Vec3 once = unit(reflected(direction_of(p, i), {m.normal_x[i], m.normal_y[i], m.normal_z[i]}));
    to.dx[i] = once.x;
    to.dy[i] = once.y;
    to.dz[i] = once.z;
  }
}

/// Mirrors in the face what goes to the wrong side of it: inside for `side` 1, outside for -1.
WHITTLE_INLINE void turn_back(const HitPacket& __restrict p, double side, SecondaryRayPacket& __restrict to) {
  for (int i = 0; i < lanes; ++i) {
    const Vec3 once{to.dx[i], to.dy[i], to.dz[i]}, outward = outward_of(p, i);
    const Vec3 twice = unit(reflected(once, outward));
    const bool wrong = (once.x * outward.x + once.y * outward.y + once.z * outward.z) * side < 0;
    to.dx[i] = wrong ? twice.x : once.x;
    to.dy[i] = wrong ? twice.y : once.y;
    to.dz[i] = wrong ? twice.z : once.z;
  }
}

WHITTLE_INLINE void divide(const HitPacket& __restrict p, const InterfacePacket& __restrict n, Meeting& __restrict m) {
  for (int i = 0; i < lanes; ++i) {
    const double cosine =
        -(p.direction_x[i] * m.normal_x[i] + p.direction_y[i] * m.normal_y[i] + p.direction_z[i] * m.normal_z[i]);
    const double cos_i = cosine < 1 ? cosine : 1;
    const Interface at = dielectric_interface(cos_i, n.n_from[i], n.n_to[i]);
    const bool fresnel = p.terms.fresnel[i] > 0, refracts = p.terms.refracts[i] > 0;
    const bool total = at.total_internal_reflection & (fresnel | refracts);
    const double transmittance = fresnel ? 1 - at.reflectance : 1;
    m.cos_i[i] = cos_i;
    m.cos_t[i] = at.cos_t;
    m.reflectance[i] = fresnel ? at.reflectance : 1;
    m.passing[i] = total ? 0 : transmittance;
    m.returning[i] = total & !fresnel ? 1 : 0;
  }
}

WHITTLE_INLINE void refract(const HitPacket& __restrict p, const InterfacePacket& __restrict n,
                            const Meeting& __restrict m, SecondaryRayPacket& __restrict to) {
  for (int i = 0; i < lanes; ++i) {
    const Vec3 d = direction_of(p, i);
    const Vec3 bent =
        refracted(d, {m.normal_x[i], m.normal_y[i], m.normal_z[i]}, m.cos_i[i], m.cos_t[i], n.n_from[i], n.n_to[i]);
    const bool refracts = p.terms.refracts[i] > 0;
    to.dx[i] = refracts ? bent.x : d.x;
    to.dy[i] = refracts ? bent.y : d.y;
    to.dz[i] = refracts ? bent.z : d.z;
  }
}

/// offset_origin, the distance given.
WHITTLE_INLINE void start(const HitPacket& __restrict packet, const ShadingPointPacket& __restrict f,
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

WHITTLE_INLINE void weigh_lane(const HitPacket& p, int i, const Color& factor, SecondaryRayPacket& to) {
  const double r = p.weight_r[i] * factor.r, g = p.weight_g[i] * factor.g, b = p.weight_b[i] * factor.b;
  const double larger = r > g ? r : g;
  to.r[i] = r;
  to.g[i] = g;
  to.b[i] = b;
  to.largest[i] = larger > b ? larger : b;
}

WHITTLE_INLINE LaneMask unless_black(const Color& factor, int i) {
  return (factor.r == 0) & (factor.g == 0) & (factor.b == 0) ? 0 : LaneMask{1} << i;
}

WHITTLE_INLINE void weigh(const HitPacket& __restrict p, const Meeting& __restrict m,
                          SecondaryRayPacket& __restrict mirrored, SecondaryRayPacket& __restrict through) {
  const CoefficientPacket& terms = p.terms;
  LaneMask mirrors = 0, passes = 0;
  for (int i = 0; i < lanes; ++i) {
    const double share = m.reflectance[i], more = m.returning[i], passing = m.passing[i];
    const Color back{terms.mirror[0][i] * share + terms.through[0][i] * more,
                     terms.mirror[1][i] * share + terms.through[1][i] * more,
                     terms.mirror[2][i] * share + terms.through[2][i] * more};
    const Color onward{terms.through[0][i] * passing, terms.through[1][i] * passing, terms.through[2][i] * passing};
    weigh_lane(p, i, back, mirrored);
    weigh_lane(p, i, onward, through);
    mirrors |= unless_black(back, i);
    passes |= unless_black(onward, i);
  }
  mirrored.going = mirrors & first_lanes(p.count);
  through.going = passes & first_lanes(p.count);
}

/// Reflections and refractions of one ray must not make the same random choices.
WHITTLE_INLINE void follow(const HitPacket& p, std::uint64_t which, SecondaryRayPacket& to) {
  for (int i = 0; i < lanes; ++i) to.path[i] = static_cast<std::uint32_t>(mix(std::uint64_t{p.path[i]} * 2 + which));
}

}  // namespace

WHITTLE_WIDE void mirror(const HitPacket& __restrict packet, const ShadingPointPacket& __restrict shading_point,
                         SecondaryRayPacket& __restrict mirrored) {
  Meeting meeting;
  find_normals(packet, shading_point, meeting);
  reflect(packet, meeting, mirrored);
  turn_back(packet, 1, mirrored);
  start(packet, shading_point, mirrored);
  const auto& factor = packet.terms.mirror;
  for (int i = 0; i < lanes; ++i) weigh_lane(packet, i, {factor[0][i], factor[1][i], factor[2][i]}, mirrored);
  mirrored.going = packet.terms.mirrors & first_lanes(packet.count);
  follow(packet, 0, mirrored);
}

WHITTLE_WIDE void part(const HitPacket& __restrict packet, const ShadingPointPacket& __restrict shading_point,
                       const InterfacePacket& __restrict interfaces, bool bent, SecondaryRayPacket& __restrict mirrored,
                       SecondaryRayPacket& __restrict through) {
  Meeting meeting;
  find_normals(packet, shading_point, meeting);
  divide(packet, interfaces, meeting);
  weigh(packet, meeting, mirrored, through);
  if (through.going != 0) {
    refract(packet, interfaces, meeting, through);
    if (bent) turn_back(packet, -1, through);
    start(packet, shading_point, through);
    follow(packet, 1, through);
  }
  if (mirrored.going == 0) return;
  reflect(packet, meeting, mirrored);
  turn_back(packet, 1, mirrored);
  start(packet, shading_point, mirrored);
  follow(packet, 0, mirrored);
}

WHITTLE_WIDE LaneMask faint(const SecondaryRayPacket& branches, double cutoff) {
  LaneMask lanes_below = 0;
  for (int i = 0; i < lanes; ++i)
    lanes_below |= (branches.largest[i] < cutoff) | (branches.largest[i] == 0) ? LaneMask{1} << i : 0;
  return lanes_below & branches.going;
}

}  // namespace tracer
