#pragma once
/// Reflected and transmitted rays spawned by 16 hits.

#include "tracer/src/integrators/whitted/intersection_packet.h"

namespace tracer {

/// Secondary rays, lane by lane with the hits.
struct alignas(64) SecondaryRayPacket {
  VecLanes origin, direction;
  ColorLanes throughput;
  double largest[lanes];  ///< largest channel of the throughput
  std::uint32_t path[lanes];
  LaneMask going;  ///< lanes with a ray
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
