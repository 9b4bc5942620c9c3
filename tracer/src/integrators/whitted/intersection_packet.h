#pragma once
/// Packets of 16 hits, from the accelerator's intersections to shading points and secondary rays.

#include "tracer/src/integrators/ray_queue.h"
#include "tracer/src/interaction/shading_points.h"
#include "tracer/src/interaction/surface.h"
#include "tracer/src/materials/compiled_material.h"

namespace tracer {

/// Coefficients of a packet's materials. Kept until the materials change: neighboring packets mostly share them.
struct alignas(64) CoefficientPacket {
  std::uint32_t material[lanes];
  ColorLanes emitted_ambient, diffuse, specular, reflectance;
  double shininess[lanes];
  int blinn[lanes];
  LaneMask reflects;  ///< lanes whose reflectance is not black
  LaneMask textured;
  LaneMask splits;  ///< lanes that transmit light or split it by Fresnel's equations
  bool any_emitted, any_specular, any_blinn, any_normal_map;

  // Valid if `splits` is not empty.
  ColorLanes transmittance;
  double refracts[lanes], fresnel[lanes];  ///< 0 or 1

  CoefficientPacket() { std::fill_n(material, lanes, none); }

 private:
  static constexpr std::uint32_t none = 0xffffffffu;
};

/// Intersections of rays with surfaces. All lanes hold a hit: from `count` on, copies of the first.
struct alignas(64) IntersectionPacket {
  int count;
  int ray[lanes];  ///< index in the queue
  RayHitPacket ray_hits;
  VecLanes direction;
  PointPacket points;
  double back_face[lanes];  ///< 1: the ray hits the back; else 0
};

/// Intersections with everything that shading needs.
struct alignas(64) HitPacket : IntersectionPacket {
  ColorLanes throughput;  ///< the ray's, at the hit
  std::uint32_t path[lanes];

  std::uint32_t material[lanes];
  CoefficientPacket coefficients;
  ColorLanes emitted;  ///< emission and ambient light, times throughput
};

/// Gathers the rays `ray[0..count)` of the queue and their hits. Sets neither `points` nor the members after it.
void load(const RayQueue& rays, const HitSpan& hits, const std::uint32_t* ray, int count, IntersectionPacket& packet);
void load(const RayQueue& rays, const HitSpan& hits, const std::uint32_t* ray, int count, HitPacket& packet,
          ShadingPointPacket& shading_points);

/// Sets `back_face` and the positions, normals and view directions of the shading points from `points`.
void orient_normals(HitPacket& packet, ShadingPointPacket& shading_points);

/// Gathers the coefficients of the packet's materials. `materials` must be the same for the packet's lifetime.
void gather_coefficients(const std::vector<CompiledMaterial>& materials, HitPacket& packet);

/// Multiplies the coefficients by the throughput, into both packets.
void apply_throughput(HitPacket& packet, ShadingPointPacket& shading_points);

/// Replaces a textured lane's emitted and diffuse coefficients; `emitted` and `diffuse` are those at the hit.
void set_textured_color(const Color& emitted, const Color& diffuse, int lane, HitPacket& packet,
                        ShadingPointPacket& shading_points);

}  // namespace tracer
