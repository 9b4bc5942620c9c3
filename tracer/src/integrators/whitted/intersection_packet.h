#pragma once
/// Packets of 16 hits, from the accelerator's intersections to shading points and secondary rays. Shading points are
/// SoA packets of position, normals and BRDF coefficients that do not depend on the light. A hit has one shading point;
/// on a Gouraud-shaded triangle it has three, the vertices, and for light that comes through the surface as many more
/// on the far side.

#include <cstdint>
#include <vector>

#include "tracer/src/accel/accelerator.h"
#include "tracer/src/integrators/ray_queue.h"
#include "tracer/src/interaction/surface.h"
#include "tracer/src/materials/compiled_material.h"
#include "tracer/src/math/lanes.h"
#include "tracer/src/math/rounding.h"

namespace tracer {

struct ShadingPoint {
  BoundedPoint point{};
  Vec3 face{};       ///< unit geometric normal; shadow rays are offset along it
  Vec3 normal{};     ///< unit, on the incident side
  Vec3 to_eye{};     ///< unit
  Color diffuse{};   ///< factor of N.L: throughput times K_d C
  Color specular{};  ///< factor of the highlight: throughput times K_s C_s
  double shininess = 0;
  bool blinn = false;     ///< Blinn's highlight instead of Phong's
  bool far_side = false;  ///< the side that the ray does not arrive at: its light comes through the surface
  double eta = 1;         ///< far side: index of refraction there over that on the near side, 1 unless refracted
  std::uint32_t hit = 0;  ///< index of the hit
  Vec3 shadow_offset{};   ///< from the point to the start of shadow rays

  // Copied from the ray to the shadow rays.
  std::uint32_t sample = 0, media = 0;
  PrimitiveRef from{};
};

struct alignas(64) ShadingPointPacket {
  VecLanes position;
  double clearance[lanes];  ///< error of the position along the geometric normal
  VecLanes face, normal, to_eye;
  ColorLanes diffuse, specular;
  double shininess[lanes];
  int specular_model[lanes];  ///< 0: none, 1: Phong's, 2: Blinn's
  double eta[lanes];          ///< undefined unless `far_side`
  std::uint32_t hit[lanes];
  std::uint32_t sample[lanes], media[lanes];
  PrimitiveRef from[lanes];
  int count;                     ///< lanes in use; the others are unspecified
  bool any_specular, any_blinn;  ///< over the lanes in use
  bool far_side;                 ///< the lanes in use are those of the other side of the surfaces
  bool smooth;                   ///< false: `shadow_offset` is undefined and counts as zero
  VecLanes shadow_offset;        ///< from the position to the start of shadow rays

  /// Point that shadow rays start next to.
  [[nodiscard]] Vec3 shadow_start(int lane) const {
    return smooth ? position[lane] + shadow_offset[lane] : position[lane];
  }
};

class ShadingPointQueue {
 public:
  /// Empties the queue and keeps its memory.
  void clear() { packets_in_use_ = 0; }

  /// Appends an empty packet.
  ShadingPointPacket& append_packet() {
    if (packets_in_use_ == packets_.size()) packets_.emplace_back();
    ShadingPointPacket& packet = packets_[packets_in_use_++];
    packet.count = 0;
    packet.any_specular = packet.any_blinn = packet.far_side = packet.smooth = false;
    return packet;
  }

  /// The points of a queue are all on the same side.
  void push(const ShadingPoint& shading_point) {
    const bool full = packets_in_use_ == 0 || packets_[packets_in_use_ - 1].count == lanes;
    ShadingPointPacket& packet = full ? append_packet() : packets_[packets_in_use_ - 1];
    const int lane = packet.count++;
    packet.clearance[lane] = clearance(shading_point.point, shading_point.face);
    packet.position.set(lane, shading_point.point.position);
    packet.face.set(lane, shading_point.face);
    packet.normal.set(lane, shading_point.normal);
    packet.to_eye.set(lane, shading_point.to_eye);
    packet.diffuse.set(lane, shading_point.diffuse);
    packet.specular.set(lane, shading_point.specular);
    const bool has_specular = !is_black(shading_point.specular);
    packet.shininess[lane] = shading_point.shininess;
    packet.specular_model[lane] = !has_specular ? 0 : shading_point.blinn ? 2 : 1;
    packet.far_side = shading_point.far_side;
    packet.eta[lane] = shading_point.eta;
    packet.shadow_offset.set(lane, shading_point.shadow_offset);
    packet.smooth |= !(shading_point.shadow_offset == Vec3{});
    packet.hit[lane] = shading_point.hit;
    packet.any_specular |= has_specular;
    packet.any_blinn |= has_specular && shading_point.blinn;
    packet.sample[lane] = shading_point.sample;
    packet.media[lane] = shading_point.media;
    packet.from[lane] = shading_point.from;
  }

  [[nodiscard]] std::size_t packets() const { return packets_in_use_; }
  [[nodiscard]] const ShadingPointPacket& packet(std::size_t i) const { return packets_[i]; }

 private:
  std::vector<ShadingPointPacket> packets_;
  std::size_t packets_in_use_ = 0;
};

/// Coefficients of a packet's materials. Kept until the materials change: neighboring packets mostly share them.
/// Textured lanes are set for every packet.
struct alignas(64) CoefficientPacket {
  std::uint32_t material[lanes];
  ColorLanes emitted_ambient, diffuse, specular, reflectance;
  double shininess[lanes];
  int blinn[lanes];
  LaneMask reflects;  ///< lanes whose reflectance is not black
  LaneMask textured;
  LaneMask splits;  ///< lanes that let light pass or split it by Fresnel's equations
  bool any_emitted, any_specular, any_blinn, any_normal_map;

  // Valid if `splits` is not empty.
  ColorLanes transmittance;
  double refracts[lanes], fresnel[lanes];  ///< 0 or 1

  // Set by gather_far_side().
  LaneMask transmits_light = 0;  ///< lanes that lights on the far side brighten
  ColorLanes diffuse_transmission, specular_transmission;

  CoefficientPacket() { std::fill_n(material, lanes, none); }

  void set_far_side(int lane, const Coefficients& coefficients) {
    diffuse_transmission.set(lane, coefficients.diffuse_transmission);
    specular_transmission.set(lane, coefficients.specular_transmission);
  }

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

/// A hit on a principled material.
struct PrincipledHit {
  PrincipledPoint point;
  Color weight;  ///< throughput times opacity; black: the hit is on another material
};

/// Secondary rays, lane by lane with the hits.
struct alignas(64) SecondaryRayPacket {
  VecLanes origin, direction;
  ColorLanes throughput;
  double largest[lanes];  ///< largest channel of the throughput
  std::uint32_t path[lanes];
  LaneMask going;  ///< lanes with a ray
};

/// Gathers the rays `ray[0..count)` of the queue and their hits. Sets neither `points` nor the members after it.
void load(const RayQueue& rays, const HitSpan& hits, const std::uint32_t* ray, int count, IntersectionPacket& packet);
void load(const RayQueue& rays, const HitSpan& hits, const std::uint32_t* ray, int count, HitPacket& packet,
          ShadingPointPacket& shading_points);

/// Sets `back_face` and the positions, normals and view directions of the shading points from `points`.
void orient_normals(HitPacket& packet, ShadingPointPacket& shading_points);

/// Gathers the coefficients of the packet's materials. `materials` must be the same for the packet's lifetime.
void gather_coefficients(const std::vector<CompiledMaterial>& materials, HitPacket& packet);
/// Gathers those of light that comes through the surfaces, which few scenes need.
void gather_far_side(const std::vector<CompiledMaterial>& materials, HitPacket& packet);

/// Multiplies the coefficients by the throughput, into both packets.
void apply_throughput(HitPacket& packet, ShadingPointPacket& shading_points);

/// Replaces a textured lane's coefficients by those at the hit.
void set_textured_coefficients(const Coefficients& coefficients, int lane, HitPacket& packet,
                               ShadingPointPacket& shading_points);

}  // namespace tracer
