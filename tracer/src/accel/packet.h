#pragma once
/// Sixteen rays in double precision beside the sixteen float rays that Embree traverses with. Embree only *proposes*
/// primitives: hits, their distances and their order are computed here, in double, from the original rays.
///
/// Embree's float ray does not start at the ray's origin but at the distance `start` along it: where the ray enters the
/// bounding sphere of the scene, or slightly behind the origin if that is inside. Its coordinates stay near one however
/// far away the camera is, and nothing close to the origin is lost to rounding; hits behind the origin are rejected in
/// double. A sphere instead of the box takes no divisions; a ray that misses the box costs Embree one visit of the root
/// node.

#include <embree3/rtcore.h>

#include <cstdint>
#include <limits>

#include "tracer/src/accel/accelerator.h"
#include "tracer/src/accel/triangle_pairs.h"
#include "tracer/src/math/affine.h"
#include "tracer/src/math/lanes.h"

namespace tracer {

inline constexpr int packet_size = lanes;

/// Margin by which Embree's float rays start earlier and reach further than the rays. In units of the scene's box
/// (about one), whose floats have an error of 2^-24; sixteen times that covers origin, direction and box tests
/// together.
inline constexpr double float_slack = 0x1p-20;

/// Bounding sphere of the scene's box.
struct BoundingSphere {
  Vec3 center;
  double radius;    ///< minus infinity: empty
  double away = 0;  ///< length of `center`
};

/// Greatest distance, in the same units, at which a ray may enter the sphere. Beyond it the last bit of the direction
/// is 2^47 boxes wide, so the ray hits nothing, and Embree would end the process on such coordinates.
inline constexpr double distance_max = 0x1p100;

/// Dominant axis of all active rays; `mixed` if it differs.
enum class DominantAxis { x, y, z, mixed };

/// The lanes that one call of Embree covers: a packet, half of it where Embree's vectors hold eight floats, or one
/// lane.
inline constexpr int half_packet = packet_size / 2;
struct LaneRange {
  int first, count;
};

/// Calls `loop(lane, k)` for the lanes of the range, k = lane - range.first. Constant trip counts and offsets let the
/// loops vectorize.
template <class Loop>
WHITTLE_INLINE void for_lanes(LaneRange range, const Loop& loop) {
  if (range.count == packet_size)
    for (int i = 0; i < packet_size; ++i) loop(i, i);
  else if (range.count == 1)
    loop(range.first, 0);
  else if (range.first == 0)
    for (int k = 0; k < half_packet; ++k) loop(k, k);
  else
    for (int k = 0; k < half_packet; ++k) loop(half_packet + k, k);
}

struct alignas(64) Packet {
  RTCIntersectContext context;  // first: Embree passes a pointer to it to the callbacks
  VecLanes origin, direction;
  double t[packet_size];      ///< nearest hit so far, or the ray's end
  double start[packet_size];  ///< origin of Embree's ray, as a distance along this one
  double u[packet_size], v[packet_size];
  alignas(64) std::uint32_t geometry[packet_size];
  std::uint32_t primitive[packet_size];
  std::uint32_t from_geometry[packet_size];  ///< the primitive the ray starts on
  std::uint32_t from_primitive[packet_size];
  alignas(64) float reach[packet_size];        ///< Embree's tfar
  alignas(64) int active[packet_size];         ///< -1 in lanes that Embree traverses
  int blocked[packet_size];                    ///< -1 in lanes with a plane within the ray
  alignas(64) float error_bound[packet_size];  ///< double_error_bound()
  float float_bound;                           ///< float_error_bound()
  DominantAxis dominant;

  static Packet& of(const RTCIntersectContext* context) {
    // The context is the first member of a standard-layout struct.
    return *const_cast<Packet*>(reinterpret_cast<const Packet*>(context));
  }
};
static_assert(std::is_standard_layout_v<Packet>);

/// Embree's tfar for a hit at t: beyond it by the slack, so that rounding culls nothing nearer.
inline float reach_of(double t, double start) { return static_cast<float>((t - start) * (1 + 0x1p-22) + float_slack); }

/// Returns true if Embree must traverse any lane.
WHITTLE_INLINE bool any_active(const Packet& packet) {
  int any = 0;
  for (const int active : packet.active) any |= active;
  return any != 0;
}

/// Returns true if the lane's ray starts on this primitive. Flat primitives are not hit again.
WHITTLE_INLINE bool starts_on(const Packet& packet, int lane, PrimitiveRef self) {
  return (packet.from_geometry[lane] == self.geometry) & (packet.from_primitive[lane] == self.primitive);
}

/// Replaces the lane's nearest hit and Embree's tfar by a hit at t if that is `valid` and nearer; returns true then. Of
/// equal distances the lowest primitive wins.
WHITTLE_INLINE bool update_nearest(Packet& packet, int i, float& tfar, double t, PrimitiveRef self, bool valid) {
  const std::uint32_t geometry = packet.geometry[i], primitive = packet.primitive[i];
  const bool first = (self.geometry < geometry) | ((self.geometry == geometry) & (self.primitive < primitive));
  const double best = packet.t[i];
  const bool nearer = valid & ((t < best) | ((t == best) & first));
  packet.t[i] = nearer ? t : best;
  packet.geometry[i] = nearer ? self.geometry : geometry;
  packet.primitive[i] = nearer ? self.primitive : primitive;
  tfar = nearer ? reach_of(t, packet.start[i]) : tfar;
  return nearer;
}

/// Ends Embree's ray if it is occluded.
WHITTLE_INLINE void update_occluded(float& tfar, bool occluded) {
  tfar = occluded ? -std::numeric_limits<float>::infinity() : tfar;
}

/// Sets the members of a packet and of Embree's rays that are equal for all packets of `rays`.
void begin(Packet& packet, const RaySpan& rays, Coherence coherence, unsigned mask, RTCRay16& ray);

/// Loads `count` lanes from rays[first...]. Unused lanes, rays that are not finite and rays that miss `sphere` are
/// inactive.
void load(Packet& packet, const RaySpan& rays, std::size_t first, int count, const BoundingSphere& sphere);

/// Sets `dominant`, `error_bound` and `float_bound`, which only triangles use.
void load_for_triangles(Packet& packet, const BoundingSphere& sphere);

/// Converts the packet to Embree's rays.
void write_rays(const Packet& packet, RTCRay16& ray);

/// Writes the results of `count` lanes to hits[first...] and blocked[0...].
void write_hits(const Packet& packet, const HitSpan& hits, std::size_t first, int count);
void write_blocked(const Packet& packet, const RTCRay16& ray, std::uint8_t* blocked, int count);

// Intersect one Embree primitive in double, in the lanes of the range with `valid` = -1. `valid`, `tfar` and `rays`
// begin at the first lane of the range; `rays` is not used for a range of one lane. A hit's part of a quadric is stored
// in the packet's `u`. Spheres and quadrics may be hit again by a ray that starts on them.

void intersect(Packet& packet, LaneRange range, const int* valid, float* tfar, RTCRayN* rays,
               const SphereGeometry& geometry, PrimitiveRef self);
void intersect(Packet& packet, LaneRange range, const int* valid, float* tfar, RTCRayN* rays,
               const QuadricGeometry& geometry, PrimitiveRef self);
void intersect(Packet& packet, LaneRange range, const int* valid, float* tfar, RTCRayN* rays,
               const TriangleGeometry& geometry, const TrianglePairBounds& pair);
void occluded(const Packet& packet, LaneRange range, const int* valid, float* tfar, RTCRayN* rays,
              const SphereGeometry& geometry, PrimitiveRef self);
void occluded(const Packet& packet, LaneRange range, const int* valid, float* tfar, RTCRayN* rays,
              const QuadricGeometry& geometry, PrimitiveRef self);
void occluded(const Packet& packet, LaneRange range, const int* valid, float* tfar, RTCRayN* rays,
              const TriangleGeometry& geometry, const TrianglePairBounds& pair);

/// Intersects all planes of the mask in all lanes.
void intersect_planes(Packet& packet, const PlaneGeometry& planes, std::uint32_t geometry, GeometryMask mask);
void occluded_by_planes(Packet& packet, const PlaneGeometry& planes, std::uint32_t geometry);

}  // namespace tracer
