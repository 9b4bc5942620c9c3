#pragma once
/// Shading points in SoA packets of 16: position, normals and BRDF coefficients that do not depend on the light. A hit
/// has one shading point; on a Gouraud-shaded triangle it has three, the vertices.

#include <cstdint>
#include <vector>

#include "tracer/src/accel/geometry.h"
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
  std::uint32_t hit = 0;  ///< index of the hit

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
  int has_specular[lanes];  ///< 0 or 1
  int blinn[lanes];         ///< 0 or 1
  std::uint32_t hit[lanes];
  std::uint32_t sample[lanes], media[lanes];
  PrimitiveRef from[lanes];
  int count;                     ///< lanes in use; the others are unspecified
  bool any_specular, any_blinn;  ///< over the lanes in use
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
    packet.any_specular = packet.any_blinn = false;
    return packet;
  }

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
    packet.has_specular[lane] = has_specular ? 1 : 0;
    packet.blinn[lane] = shading_point.blinn ? 1 : 0;
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

}  // namespace tracer
