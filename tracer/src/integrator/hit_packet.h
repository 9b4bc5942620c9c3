#pragma once
/// Sixteen hits on their way from the accelerator's answers to the lights and to the next generation.

#include "tracer/src/integrator/facings.h"
#include "tracer/src/integrator/hits.h"
#include "tracer/src/integrator/ray_queue.h"
#include "tracer/src/materials/terms.h"
#include "tracer/src/shapes/point_packet.h"

namespace tracer {

/// All lanes hold a hit: beyond `count` it is the first once more, which is of no use.
struct alignas(64) HitPacket {
  int count;
  int ray[lanes];  ///< which of the queue
  MetPacket met;
  double direction_x[lanes], direction_y[lanes], direction_z[lanes];  ///< the ray's
  double weight_r[lanes], weight_g[lanes], weight_b[lanes];           ///< the ray's when it arrives
  std::uint32_t path[lanes];                                          ///< the ray's

  PointPacket points;
  double behind[lanes];  ///< 1: the ray meets the back

  // Of the materials.
  std::uint32_t material[lanes];
  double own_r[lanes], own_g[lanes], own_b[lanes];
  double mirror_r[lanes], mirror_g[lanes], mirror_b[lanes];
  bool any_own, any_mirror;  ///< among all lanes
  bool any_branches, any_textured, any_bends;

  [[nodiscard]] Color weight(int i) const { return {weight_r[i], weight_g[i], weight_b[i]}; }
};

/// Rays that mirrors send on, beside the hits.
struct alignas(64) MirroredPacket {
  double ox[lanes], oy[lanes], oz[lanes];
  double dx[lanes], dy[lanes], dz[lanes];
  double r[lanes], g[lanes], b[lanes];  ///< weights
  double largest[lanes];                ///< of these
  std::uint32_t path[lanes];
};

/// The rays `ray[0..count)` of the queue and what they met. The rest of a hit is none of this function's.
void load(const RayQueue& rays, const HitSpan& hits, const std::uint32_t* ray, int count, HitPacket& packet,
          FacingPacket& facing);

/// From the points on: places, normals and directions of `facing`, and `behind`.
void face(HitPacket& packet, FacingPacket& facing);

/// What the materials make of light at the hits, into both packets.
void take_materials(const std::vector<MaterialTerms>& terms, HitPacket& packet, FacingPacket& facing);

/// One more time for a lane whose colour is known only at its hit; `terms` are those of its material there.
void take_color(const Color& own, const Color& diffuse, int lane, HitPacket& packet, FacingPacket& facing);

/// What mirrors send on: reflected in the normal as seen by the ray, and once more in the face where an interpolated or
/// bent normal let a grazing ray end up inside.
void mirror(const HitPacket& packet, const FacingPacket& facing, MirroredPacket& mirrored);

}  // namespace tracer
