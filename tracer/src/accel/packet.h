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

/// How far, in the same units, a hit refined in double may lie outside its float triangle and still be that triangle's.
inline constexpr double triangle_slack = 0x1p-21;

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

/// Fills lanes [0, count) from rays[first...]; the others, rays that are not finite and rays that miss `box` are
/// inactive.
void load(Packet& packet, const RaySpan& rays, std::size_t first, int count, const Bounds& box);

/// The packet's rays as Embree wants them.
void write_rays(const Packet& packet, unsigned mask, RTCRay16& ray);

/// A sphere, double precision. The callers' lanes: those of `valid` (-1), all sixteen, or one.
struct SphereTest {
  double x, y, z, radius;
};
void closest_sphere(Packet& packet, const int* valid, float* tfar, const SphereTest& sphere, PrimitiveRef self);
void occluded_sphere(const Packet& packet, const int* valid, float* tfar, const SphereTest& sphere);
void closest_sphere_lane(Packet& packet, unsigned lane, float& tfar, const SphereTest& sphere, PrimitiveRef self);
void occluded_sphere_lane(const Packet& packet, unsigned lane, float& tfar, const SphereTest& sphere);

/// Any other analytic shape. The part that was met goes into the packet's `u`.
void closest_quadric(Packet& packet, const int* valid, float* tfar, const Quadric& quadric, PrimitiveRef self);
void occluded_quadric(const Packet& packet, const int* valid, float* tfar, const Quadric& quadric);
void closest_quadric_lane(Packet& packet, unsigned lane, float& tfar, const Quadric& quadric, PrimitiveRef self);
void occluded_quadric_lane(const Packet& packet, unsigned lane, float& tfar, const Quadric& quadric);

/// Embree proposes triangle self.primitive of `geometry`; it is tested in double. False: refused.
bool closest_triangle_lane(Packet& packet, unsigned lane, float& tfar, const TriangleGeometry& geometry,
                           PrimitiveRef self);
bool occluded_triangle_lane(const Packet& packet, unsigned lane, const TriangleGeometry& geometry, PrimitiveRef self);

/// All planes that count against all lanes that are in use.
void closest_planes(Packet& packet, int count, const PlaneGeometry& planes, std::uint32_t geometry, Among among);
void occluded_planes(const Packet& packet, int count, const PlaneGeometry& planes, std::uint32_t geometry,
                     std::uint8_t* blocked);

}  // namespace tracer
