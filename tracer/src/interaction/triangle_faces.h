#pragma once
/// Points and geometric normals of 16 hits.

#include "tracer/src/math/compress.h"
#include "tracer/src/shapes/primitive_point.h"

namespace tracer {

/// Points with error bounds and unit geometric normals, outward.
struct alignas(64) FacePacket {
  double x[lanes], y[lanes], z[lanes];
  double error_x[lanes], error_y[lanes], error_z[lanes];
  double face_x[lanes], face_y[lanes], face_z[lanes];
};

WHITTLE_INLINE void put(const PrimitivePoint& at, int i, FacePacket& to) {
  to.x[i] = at.position.x;
  to.y[i] = at.position.y;
  to.z[i] = at.position.z;
  to.error_x[i] = at.error.x;
  to.error_y[i] = at.error.y;
  to.error_z[i] = at.error.z;
  to.face_x[i] = at.across.x;
  to.face_y[i] = at.across.y;
  to.face_z[i] = at.across.z;
}

/// Normalizes the faces. Returns the lanes in which this equals normalize(); the others need its special cases.
WHITTLE_INLINE LaneMask normalize(FacePacket& to) {
  // Range of the largest component in which normalize() only divides by the length.
  constexpr double plain_min = 0x1p-300, plain_max = 0x1p300;
  LaneMask plain = 0;
  for (int i = 0; i < lanes; ++i) {
    const double across_x = to.face_x[i], across_y = to.face_y[i], across_z = to.face_z[i];
    const double x = std::abs(across_x), y = std::abs(across_y), z = std::abs(across_z);
    const double xy = x > y ? x : y, largest = xy > z ? xy : z;
    const double size = std::sqrt(across_x * across_x + across_y * across_y + across_z * across_z);
    to.face_x[i] = across_x / size;
    to.face_y[i] = across_y / size;
    to.face_z[i] = across_z / size;
    plain |= (largest > plain_min) & (largest < plain_max) ? LaneMask{1} << i : 0;
  }
  return plain;
}

}  // namespace tracer
