#pragma once
/// Reflected and transmitted rays spawned by 16 hits.

#include "tracer/src/integrators/whitted/intersection_packet.h"

namespace tracer {

/// Secondary rays, lane by lane with the hits.
struct alignas(64) SecondaryRayPacket {
  double ox[lanes], oy[lanes], oz[lanes];
  double dx[lanes], dy[lanes], dz[lanes];
  double r[lanes], g[lanes], b[lanes];  ///< throughput
  double largest[lanes];                ///< largest channel of the throughput
  std::uint32_t path[lanes];
  LaneMask going;  ///< lanes with a ray

  void put(int i, const Vec3& origin, const Vec3& direction, const Color& throughput, std::uint32_t ray_path) {
    ox[i] = origin.x;
    oy[i] = origin.y;
    oz[i] = origin.z;
    dx[i] = direction.x;
    dy[i] = direction.y;
    dz[i] = direction.z;
    r[i] = throughput.r;
    g[i] = throughput.g;
    b[i] = throughput.b;
    largest[i] = max_component(throughput);
    path[i] = ray_path;
  }
  [[nodiscard]] Vec3 direction(int i) const { return {dx[i], dy[i], dz[i]}; }
  [[nodiscard]] Color throughput(int i) const { return {r[i], g[i], b[i]}; }
};

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
/// `perturbed`: some normals are perturbed; rays that these refract back to the incident side are reflected in the
/// face.
void spawn_dielectric(const HitPacket& packet, const ShadingPointPacket& shading_points,
                      const InterfacePacket& interfaces, bool perturbed, SecondaryRayPacket& reflection,
                      SecondaryRayPacket& transmission);

/// Lanes of `going` whose throughput is below `cutoff` or zero.
LaneMask below_cutoff(const SecondaryRayPacket& rays, double cutoff);

}  // namespace tracer
