#pragma once
/// Places on surfaces as the local model sees them, as arrays: what does not change from light to light is worked out
/// once. Most hits face the lights at one place; a triangle shaded after Gouraud does at its three corners.

#include <cstdint>
#include <vector>

#include "tracer/src/math/rounding.h"
#include "tracer/src/math/wide.h"

namespace tracer {

/// Where light may arrive, by what normal, and what becomes of it on its way to the eye.
struct Facing {
  BoundedPoint point{};
  Vec3 face{};       ///< unit geometric normal: shadow rays start clear of it
  Vec3 normal{};     ///< unit, on the ray's side
  Vec3 to_eye{};     ///< unit
  Color diffuse{};   ///< what N.L is multiplied by: the path's weight times K_d C
  Color specular{};  ///< what the highlight is multiplied by: the path's weight times K_s C_s
  double shininess = 0;
  bool halfway = false;   ///< the highlight is Blinn's; else Phong's
  std::uint32_t hit = 0;  ///< whose place it is
};

/// Sixteen of them.
struct alignas(64) FacingPacket {
  double x[lanes], y[lanes], z[lanes];
  double clearance[lanes];  ///< how far from there, along the geometric normal, the point's error reaches
  double face_x[lanes], face_y[lanes], face_z[lanes];
  double normal_x[lanes], normal_y[lanes], normal_z[lanes];
  double eye_x[lanes], eye_y[lanes], eye_z[lanes];
  double diffuse_r[lanes], diffuse_g[lanes], diffuse_b[lanes];
  double specular_r[lanes], specular_g[lanes], specular_b[lanes];
  double shininess[lanes];
  int shines[lanes];   ///< it has a highlight
  int halfway[lanes];  ///< and that is Blinn's
  std::uint32_t hit[lanes];
  int count;         ///< lanes in use; the others hold what they held before
  bool any_shines;   ///< of those in use
  bool any_halfway;  ///< likewise
};

class Facings {
 public:
  /// Keeps the memory for the next ones.
  void clear() { size_ = 0; }

  __attribute__((always_inline)) void push(const Facing& facing) {
    const std::size_t number = size_ / lanes, lane = size_ % lanes;
    if (number == packets_.size()) packets_.emplace_back();
    FacingPacket& packet = packets_[number];
    if (lane == 0) packet.any_shines = packet.any_halfway = false;
    packet.count = static_cast<int>(lane) + 1;
    packet.clearance[lane] = clearance(facing.point, facing.face);
    put(facing.point.position, packet.x, packet.y, packet.z, lane);
    put(facing.face, packet.face_x, packet.face_y, packet.face_z, lane);
    put(facing.normal, packet.normal_x, packet.normal_y, packet.normal_z, lane);
    put(facing.to_eye, packet.eye_x, packet.eye_y, packet.eye_z, lane);
    put(facing.diffuse, packet.diffuse_r, packet.diffuse_g, packet.diffuse_b, lane);
    put(facing.specular, packet.specular_r, packet.specular_g, packet.specular_b, lane);
    const bool shines = !is_black(facing.specular);
    packet.shininess[lane] = facing.shininess;
    packet.shines[lane] = shines ? 1 : 0;
    packet.halfway[lane] = facing.halfway ? 1 : 0;
    packet.hit[lane] = facing.hit;
    packet.any_shines |= shines;
    packet.any_halfway |= shines && facing.halfway;
    ++size_;
  }

  [[nodiscard]] std::size_t packets() const { return (size_ + lanes - 1) / lanes; }
  [[nodiscard]] const FacingPacket& packet(std::size_t i) const { return packets_[i]; }

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

  std::vector<FacingPacket> packets_;
  std::size_t size_ = 0;
};

}  // namespace tracer
