#pragma once
/// Sixteen hits on their way from the accelerator's answers to the lights and to the next generation.

#include "tracer/src/integrators/hits.h"
#include "tracer/src/integrators/ray_queue.h"
#include "tracer/src/interaction/hit_packet.h"
#include "tracer/src/interaction/shading_points.h"
#include "tracer/src/materials/compiled_material.h"

namespace tracer {

/// The terms of a packet's materials. They stay while the materials do: neighbours mostly meet the same.
struct alignas(64) CoefficientPacket {
  std::uint32_t material[lanes];
  double own[3][lanes], diffuse[3][lanes], specular[3][lanes], mirror[3][lanes];
  double shininess[lanes];
  int blinn[lanes];
  LaneMask mirrors;  ///< those whose mirror is not black
  LaneMask textured;
  LaneMask parts;  ///< those that let light through, or whose light Fresnel divides
  bool any_own, any_shines, any_halfway, any_bends;

  // Where `parts` is not empty.
  double through[3][lanes];
  double refracts[lanes], fresnel[lanes];  ///< 1: it does

  CoefficientPacket() { std::fill_n(material, lanes, none); }

 private:
  static constexpr std::uint32_t none = 0xffffffffu;
};

/// Where rays meet surfaces. All lanes hold a hit: beyond `count` it is the first once more, which is of no use.
struct alignas(64) IntersectionPacket {
  int count;
  int ray[lanes];  ///< which of the queue
  RayHitPacket met;
  double direction_x[lanes], direction_y[lanes], direction_z[lanes];  ///< the ray's
  PointPacket points;
  double behind[lanes];  ///< 1: the ray meets the back
};

/// What shading makes of them.
struct alignas(64) HitPacket : IntersectionPacket {
  double weight_r[lanes], weight_g[lanes], weight_b[lanes];  ///< the ray's when it arrives
  std::uint32_t path[lanes];                                 ///< the ray's

  std::uint32_t material[lanes];
  CoefficientPacket terms;                          ///< of these
  double own_r[lanes], own_g[lanes], own_b[lanes];  ///< what the samples gain by the surfaces' own light

  [[nodiscard]] Color throughput(int i) const { return {weight_r[i], weight_g[i], weight_b[i]}; }
};

/// The rays `ray[0..count)` of the queue and what they met. `points` and what follows them is none of this function's.
void load(const RayQueue& rays, const HitSpan& hits, const std::uint32_t* ray, int count, IntersectionPacket& packet);
void load(const RayQueue& rays, const HitSpan& hits, const std::uint32_t* ray, int count, HitPacket& packet,
          ShadingPointPacket& shading_point);

/// From the points on: places, normals and directions of `facing`, and `behind`.
void face(HitPacket& packet, ShadingPointPacket& shading_point);

/// The materials' terms. `terms` are the same for all of a packet's life.
void take_materials(const std::vector<CompiledMaterial>& terms, HitPacket& packet);

/// What they make of light at the hits, into both packets.
void weigh(HitPacket& packet, ShadingPointPacket& shading_point);

/// One more time for a lane whose colour is known only at its hit; `terms` are those of its material there.
void take_color(const Color& own, const Color& diffuse, int lane, HitPacket& packet, ShadingPointPacket& shading_point);

}  // namespace tracer
