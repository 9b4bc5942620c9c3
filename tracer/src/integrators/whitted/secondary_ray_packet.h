#pragma once
/// What sixteen surfaces send on: rays that they mirror, and rays that go through them.

#include "tracer/src/integrators/whitted/intersection_packet.h"

namespace tracer {

/// Rays beside the hits, and which of them there are.
struct alignas(64) SecondaryRayPacket {
  double ox[lanes], oy[lanes], oz[lanes];
  double dx[lanes], dy[lanes], dz[lanes];
  double r[lanes], g[lanes], b[lanes];  ///< weights
  double largest[lanes];                ///< of these
  std::uint32_t path[lanes];
  LaneMask going;

  void put(int i, const Vec3& origin, const Vec3& direction, const Color& throughput, std::uint32_t path_there) {
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
    path[i] = path_there;
  }
  [[nodiscard]] Vec3 direction(int i) const { return {dx[i], dy[i], dz[i]}; }
  [[nodiscard]] Color throughput(int i) const { return {r[i], g[i], b[i]}; }
};

/// Refractive indices on both sides of the surfaces, as the rays meet them; those that nothing goes through and that
/// Fresnel does not divide have any above zero.
struct alignas(64) InterfacePacket {
  double n_from[lanes], n_to[lanes];
  InterfacePacket() {
    std::fill_n(n_from, lanes, 1.0);
    std::fill_n(n_to, lanes, 1.0);
  }
};

/// What goes on where nothing goes through: reflected in the normal as seen by the ray, and once more in the face where
/// an interpolated or bent normal let a grazing ray end up inside.
void mirror(const HitPacket& packet, const ShadingPointPacket& shading_point, SecondaryRayPacket& mirrored);

/// What goes on elsewhere, by Snell and Fresnel. The lanes of plain mirrors get the same bits as by mirror(). `bent`:
/// textures bend some normals; what they refract back to the ray's side is mirrored in the face.
void part(const HitPacket& packet, const ShadingPointPacket& shading_point, const InterfacePacket& interfaces,
          bool bent, SecondaryRayPacket& mirrored, SecondaryRayPacket& through);

/// Those of `going` that weigh less than `cutoff`, or nothing.
LaneMask faint(const SecondaryRayPacket& branches, double cutoff);

}  // namespace tracer
