#pragma once
/// Sixteen rays in double beside the sixteen floats that Embree traverses with. Embree only *proposes*: what is a hit,
/// how far it is and which of two is nearer are decided here, in double, on the rays as they are.
///
/// Embree's float ray does not start at the ray's origin but `start` further on: as far before the place where it comes
/// nearest to the middle of the scene as the ball around the scene's box has radius, or a little behind the origin when
/// that is inside. So its coordinates stay near one however far away the camera is, and nothing close to the origin is
/// lost to rounding; hits behind the origin are refused in double. A ball and not the box, because it takes no
/// divisions; a ray that misses the box costs Embree one look at the tree's root.

#include <embree3/rtcore.h>

#include <cstdint>

#include "tracer/src/accel/accelerator.h"
#include "tracer/src/accel/triangle_pair_bounds.h"
#include "tracer/src/math/bounds.h"
#include "tracer/src/math/wide.h"

namespace tracer {

inline constexpr int packet_size = lanes;

/// How much earlier than needed Embree's float rays start, and how much further they reach. In units of the scene's box
/// (about one), whose floats are wrong by 2^-24; sixteen times that covers origin, direction and box tests together.
inline constexpr double float_slack = 0x1p-20;

/// Around the scene's box.
struct BoundingSphere {
  Vec3 center;
  double radius;    ///< minus infinity: holds nothing
  double away = 0;  ///< of the centre from 0
};

/// How far away, in the same units, a ray may enter the ball. From further the last bit of its direction is 2^47 boxes
/// wide: it meets nothing in the box, and Embree never sees coordinates on which it would end the process.
inline constexpr double distance_max = 0x1p100;

/// Along which axis rays go most, whichever way; `mixed`: not all of them along the same.
enum class DominantAxis { x, y, z, mixed };

/// Embree asks about whole packets, or about halves where its vectors hold eight floats.
inline constexpr int half_packet = packet_size / 2;
enum class Asked { whole, first_half, second_half };

/// Runs `loop(lane, place)` over the lanes asked about, `place` counted from the first of these. Trip count and places
/// are plain either way, or it becomes no vector code.
template <class Loop>
WHITTLE_INLINE void for_lanes(Asked asked, const Loop& loop) {
  if (asked == Asked::whole)
    for (int i = 0; i < packet_size; ++i) loop(i, i);
  else if (asked == Asked::first_half)
    for (int i = 0; i < half_packet; ++i) loop(i, i);
  else
    for (int i = 0; i < half_packet; ++i) loop(half_packet + i, i);
}

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
  alignas(64) float reach[packet_size];        ///< Embree's tfar
  alignas(64) int active[packet_size];         ///< -1 where Embree has something to look for
  int blocked[packet_size];                    ///< -1 where a plane lies within the ray
  alignas(64) float error_bound[packet_size];  ///< double_error_bound()
  float float_bound;                           ///< float_error_bound()
  DominantAxis leading;                        ///< of the active rays

  static Packet& of(const RTCIntersectContext* context) {
    // The context is the first member of a standard-layout struct.
    return *const_cast<Packet*>(reinterpret_cast<const Packet*>(context));
  }
};
static_assert(std::is_standard_layout_v<Packet>);

/// Embree's tfar for a hit at t: beyond it by the slack, so that nothing nearer is culled by rounding.
inline float reach_of(double t, double start) { return static_cast<float>((t - start) * (1 + 0x1p-22) + float_slack); }

/// Whether Embree has anything to look for.
WHITTLE_INLINE bool any_active(const Packet& packet) {
  int any = 0;
  for (const int active : packet.active) any |= active;
  return any != 0;
}

/// Does a hit at t on `self` replace the nearest so far? Of equal distances the lowest primitive wins.
inline bool wins(double t, PrimitiveRef self, double best, std::uint32_t geometry, std::uint32_t primitive) {
  const bool first = (self.geometry < geometry) | ((self.geometry == geometry) & (self.primitive < primitive));
  return (t < best) | ((t == best) & first);
}

/// Does the lane's ray leave this primitive? Flat ones are not met again.
WHITTLE_INLINE bool starts_on(const Packet& packet, unsigned lane, PrimitiveRef self) {
  return (packet.from_geometry[lane] == self.geometry) & (packet.from_primitive[lane] == self.primitive);
}

/// What of a packet and of Embree's rays is the same for all packets of `rays`.
void begin(Packet& packet, const RaySpan& rays, Coherence coherence, unsigned mask, RTCRay16& ray);

/// Fills all lanes, from rays[first...]. Rays that are not finite and rays that miss `ball` are inactive.
void load(Packet& packet, const RaySpan& rays, std::size_t first, const BoundingSphere& ball);

/// Sets `leading`, `doubt` and `blur`, which only triangles ask for.
void load_for_triangles(Packet& packet, const BoundingSphere& ball);

/// The packet's rays as Embree wants them.
void write_rays(const Packet& packet, RTCRay16& ray);

/// The packet's answers, to hits[first...] and blocked[0...].
void write_hits(const Packet& packet, const HitSpan& hits, std::size_t first);
void write_blocked(const Packet& packet, const RTCRay16& ray, std::uint8_t* blocked);

/// Primitive self.primitive of `geometry`, or the triangles of `run`, decided in double. The callers' lanes: those of
/// `valid` (-1) among those asked about, of which `valid`, `tfar` and Embree's `rays` begin at the first, or one. The
/// part of a quadric that was met goes into the packet's `u`. Spheres and quadrics do not know where a ray starts: it
/// may meet the one it leaves again.
void intersect(Packet& packet, Asked asked, const int* valid, float* tfar, const SphereGeometry& geometry,
               PrimitiveRef self);
void intersect(Packet& packet, Asked asked, const int* valid, float* tfar, const QuadricGeometry& geometry,
               PrimitiveRef self);
void intersect(Packet& packet, Asked asked, const int* valid, RTCRayN* rays, const TriangleGeometry& geometry,
               const TrianglePairBounds& run);
void occluded(const Packet& packet, Asked asked, const int* valid, float* tfar, const SphereGeometry& geometry,
              PrimitiveRef self);
void occluded(const Packet& packet, Asked asked, const int* valid, float* tfar, const QuadricGeometry& geometry,
              PrimitiveRef self);
void occluded(const Packet& packet, Asked asked, const int* valid, RTCRayN* rays, const TriangleGeometry& geometry,
              const TrianglePairBounds& run);
void closest_lane(Packet& packet, unsigned lane, float& tfar, const SphereGeometry& geometry, PrimitiveRef self);
void closest_lane(Packet& packet, unsigned lane, float& tfar, const QuadricGeometry& geometry, PrimitiveRef self);
void closest_lane(Packet& packet, unsigned lane, float& tfar, const TriangleGeometry& geometry, PrimitiveRef self);
void occluded_lane(const Packet& packet, unsigned lane, float& tfar, const SphereGeometry& geometry, PrimitiveRef self);
void occluded_lane(const Packet& packet, unsigned lane, float& tfar, const QuadricGeometry& geometry,
                   PrimitiveRef self);
void occluded_lane(const Packet& packet, unsigned lane, float& tfar, const TriangleGeometry& geometry,
                   PrimitiveRef self);

/// All planes that count against all lanes.
void closest_planes(Packet& packet, const PlaneGeometry& planes, std::uint32_t geometry, GeometryMask mask);
void occluded_planes(Packet& packet, const PlaneGeometry& planes, std::uint32_t geometry);

}  // namespace tracer
