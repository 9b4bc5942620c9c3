#pragma once
/// Shading points in SoA packets of 16: position, normals and BRDF coefficients that do not depend on the light. A hit
/// has one shading point; on a Gouraud-shaded triangle it has three, the vertices.

#include <cstdint>
#include <vector>

#include "tracer/src/accel/geometry.h"
#include "tracer/src/math/rounding.h"
#include "tracer/src/math/wide.h"

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
  double x[lanes], y[lanes], z[lanes];
  double clearance[lanes];  ///< error of the position along the geometric normal
  double face_x[lanes], face_y[lanes], face_z[lanes];
  double normal_x[lanes], normal_y[lanes], normal_z[lanes];
  double eye_x[lanes], eye_y[lanes], eye_z[lanes];
  double diffuse_r[lanes], diffuse_g[lanes], diffuse_b[lanes];
  double specular_r[lanes], specular_g[lanes], specular_b[lanes];
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
    const auto lane = static_cast<std::size_t>(packet.count++);
    packet.clearance[lane] = clearance(shading_point.point, shading_point.face);
    put(shading_point.point.position, packet.x, packet.y, packet.z, lane);
    put(shading_point.face, packet.face_x, packet.face_y, packet.face_z, lane);
    put(shading_point.normal, packet.normal_x, packet.normal_y, packet.normal_z, lane);
    put(shading_point.to_eye, packet.eye_x, packet.eye_y, packet.eye_z, lane);
    put(shading_point.diffuse, packet.diffuse_r, packet.diffuse_g, packet.diffuse_b, lane);
    put(shading_point.specular, packet.specular_r, packet.specular_g, packet.specular_b, lane);
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
  static void put(const Vec3& v, double* x, double* y, double* z, std::size_t lane) {
    x[lane] = v.x;
    y[lane] = v.y;
    z[lane] = v.z;
  }
  static void put(const Color& c, double* r, double* g, double* b, std::size_t lane) {
    r[lane] = c.r;
    g[lane] = c.g;
    b[lane] = c.b;
  }

  std::vector<ShadingPointPacket> packets_;
  std::size_t packets_in_use_ = 0;
};

}  // namespace tracer
