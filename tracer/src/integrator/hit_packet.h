#pragma once
/// Sixteen hits on their way from the accelerator's answers to the lights and to the next generation.

#include "tracer/src/integrator/facings.h"
#include "tracer/src/integrator/hits.h"
#include "tracer/src/integrator/ray_queue.h"
#include "tracer/src/materials/terms.h"
#include "tracer/src/shapes/point_packet.h"

namespace tracer {

/// The terms of a packet's materials. They stay while the materials do: neighbours mostly meet the same.
struct alignas(64) TermPacket {
  std::uint32_t material[lanes];
  double own[3][lanes], diffuse[3][lanes], specular[3][lanes], mirror[3][lanes];
  double shininess[lanes];
  int halfway[lanes];
  LaneMask mirrors;  ///< those whose mirror is not black
  LaneMask textured;
  LaneMask parts;  ///< those that let light through, or whose light Fresnel divides
  bool any_own, any_shines, any_halfway, any_bends;

  // Where `parts` is not empty.
  double through[3][lanes];
  double refracts[lanes], fresnel[lanes];  ///< 1: it does

  TermPacket() { std::fill_n(material, lanes, none); }

 private:
  static constexpr std::uint32_t none = 0xffffffffu;
};

/// Where rays meet surfaces. All lanes hold a hit: beyond `count` it is the first once more, which is of no use.
struct alignas(64) PlacePacket {
  int count;
  int ray[lanes];  ///< which of the queue
  MetPacket met;
  double direction_x[lanes], direction_y[lanes], direction_z[lanes];  ///< the ray's
  PointPacket points;
  double behind[lanes];  ///< 1: the ray meets the back
};

/// What shading makes of them.
struct alignas(64) HitPacket : PlacePacket {
  double weight_r[lanes], weight_g[lanes], weight_b[lanes];  ///< the ray's when it arrives
  std::uint32_t path[lanes];                                 ///< the ray's

  std::uint32_t material[lanes];
  TermPacket terms;                                 ///< of these
  double own_r[lanes], own_g[lanes], own_b[lanes];  ///< what the samples gain by the surfaces' own light

  [[nodiscard]] Color weight(int i) const { return {weight_r[i], weight_g[i], weight_b[i]}; }
};

/// The rays `ray[0..count)` of the queue and what they met. `points` and what follows them is none of this function's.
void load(const RayQueue& rays, const HitSpan& hits, const std::uint32_t* ray, int count, PlacePacket& packet);
void load(const RayQueue& rays, const HitSpan& hits, const std::uint32_t* ray, int count, HitPacket& packet,
          FacingPacket& facing);

/// From the points on: places, normals and directions of `facing`, and `behind`.
void face(HitPacket& packet, FacingPacket& facing);

/// The materials' terms. `terms` are the same for all of a packet's life.
void take_materials(const std::vector<MaterialTerms>& terms, HitPacket& packet);

/// What they make of light at the hits, into both packets.
void weigh(HitPacket& packet, FacingPacket& facing);

/// One more time for a lane whose colour is known only at its hit; `terms` are those of its material there.
void take_color(const Color& own, const Color& diffuse, int lane, HitPacket& packet, FacingPacket& facing);

}  // namespace tracer
