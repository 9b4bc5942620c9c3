#pragma once
/// Sixteen rays in double beside the sixteen floats that Embree traverses with. Embree only *proposes*: what is a hit,
/// how far it is and which of two is nearer are decided here, in double, on the rays as they are.
///
/// Embree's float ray does not start at the ray's origin but `start` further on: a little before the place where it
/// enters the scene's box, or a little behind the origin when that is inside. So its coordinates stay near one however
/// far away the camera is, and nothing close to the origin is lost to rounding; hits behind the origin are refused in
/// double.

#include <embree3/rtcore.h>

#include <cstdint>

#include "tracer/src/accel/accelerator.h"
#include "tracer/src/accel/inline.h"
#include "tracer/src/scene/trace_frame.h"

// One binary runs on any x86-64-v2 machine and is fast on the newest. No clone may contract a*b+c (-ffp-contract=off),
// so all give the same bits. Sanitizers start too late for the resolvers that this needs.
#if defined(__GNUC__) && !defined(__clang__) && !defined(WHITTLE_SANITIZED)
#define WHITTLE_WIDE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define WHITTLE_WIDE
#endif

namespace tracer {

inline constexpr int packet_size = 16;

/// How much earlier than needed Embree's float rays start, and how much further they reach. In units of the scene's box
/// (about one), whose floats are wrong by 2^-24; sixteen times that covers origin, direction and box tests together.
inline constexpr double float_slack = 0x1p-20;

/// How far away, in the same units, a ray may enter the box. From further the last bit of its direction is 2^47 boxes
/// wide: it meets nothing in the box, and Embree never sees coordinates on which it would end the process.
inline constexpr double distance_max = 0x1p100;

struct alignas(64) Packet {
  RTCIntersectContext context;  // first: Embree hands a pointer to it to the callbacks
  alignas(64) double ox[packet_size];
  double oy[packet_size], oz[packet_size];
  double dx[packet_size], dy[packet_size], dz[packet_size];
  double t[packet_size];      ///< nearest hit so far, or the ray's end
  double start[packet_size];  ///< where Embree's ray starts, as a distance along this one
  double u[packet_size], v[packet_size];
  alignas(64) std::uint32_t geometry[packet_size];
  std::uint32_t primitive[packet_size];
  std::uint32_t from_geometry[packet_size];  ///< the primitive the ray starts on
  std::uint32_t from_primitive[packet_size];
  alignas(64) float reach[packet_size];  ///< Embree's tfar
  alignas(64) int active[packet_size];   ///< -1 where Embree has something to look for

  static Packet& of(const RTCIntersectContext* context) {
    // The context is the first member of a standard-layout struct.
    return *const_cast<Packet*>(reinterpret_cast<const Packet*>(context));
  }
};
static_assert(std::is_standard_layout_v<Packet>);

/// Embree's tfar for a hit at t: beyond it by the slack, so that nothing nearer is culled by rounding.
inline float reach_of(double t, double start) { return static_cast<float>((t - start) * (1 + 0x1p-22) + float_slack); }

/// Does a hit at t on `self` replace the nearest so far? Of equal distances the lowest primitive wins.
inline bool wins(double t, PrimitiveRef self, double best, std::uint32_t geometry, std::uint32_t primitive) {
  const bool first = (self.geometry < geometry) | ((self.geometry == geometry) & (self.primitive < primitive));
  return (t < best) | ((t == best) & first);
}

/// Does the lane's ray leave this primitive? Flat ones are not met again.
WHITTLE_INLINE bool starts_on(const Packet& packet, unsigned lane, PrimitiveRef self) {
  return (packet.from_geometry[lane] == self.geometry) & (packet.from_primitive[lane] == self.primitive);
}

/// Fills lanes [0, count) from rays[first...]; the others, rays that are not finite and rays that miss `box` are
/// inactive.
void load(Packet& packet, const RaySpan& rays, std::size_t first, int count, const Bounds& box);

/// The packet's rays as Embree wants them.
void write_rays(const Packet& packet, unsigned mask, RTCRay16& ray);

/// Primitive self.primitive of `geometry`, decided in double. The callers' lanes: those of `valid` (-1), all sixteen,
/// or one. The part of a quadric that was met goes into the packet's `u`. Spheres and quadrics do not know where a ray
/// starts: it may meet the one it leaves again.
void closest(Packet& packet, const int* valid, float* tfar, const SphereGeometry& geometry, PrimitiveRef self);
void closest(Packet& packet, const int* valid, float* tfar, const QuadricGeometry& geometry, PrimitiveRef self);
void closest(Packet& packet, const int* valid, float* tfar, const TriangleGeometry& geometry, PrimitiveRef self);
void occluded(const Packet& packet, const int* valid, float* tfar, const SphereGeometry& geometry, PrimitiveRef self);
void occluded(const Packet& packet, const int* valid, float* tfar, const QuadricGeometry& geometry, PrimitiveRef self);
void occluded(const Packet& packet, const int* valid, float* tfar, const TriangleGeometry& geometry, PrimitiveRef self);
void closest_lane(Packet& packet, unsigned lane, float& tfar, const SphereGeometry& geometry, PrimitiveRef self);
void closest_lane(Packet& packet, unsigned lane, float& tfar, const QuadricGeometry& geometry, PrimitiveRef self);
void closest_lane(Packet& packet, unsigned lane, float& tfar, const TriangleGeometry& geometry, PrimitiveRef self);
void occluded_lane(const Packet& packet, unsigned lane, float& tfar, const SphereGeometry& geometry, PrimitiveRef self);
void occluded_lane(const Packet& packet, unsigned lane, float& tfar, const QuadricGeometry& geometry,
                   PrimitiveRef self);
void occluded_lane(const Packet& packet, unsigned lane, float& tfar, const TriangleGeometry& geometry,
                   PrimitiveRef self);

/// All planes that count against all lanes that are in use.
void closest_planes(Packet& packet, int count, const PlaneGeometry& planes, std::uint32_t geometry, Among among);
void occluded_planes(const Packet& packet, int count, const PlaneGeometry& planes, std::uint32_t geometry,
                     std::uint8_t* blocked);

}  // namespace tracer
