#include "tests/bench/bare_embree.h"

#include <embree3/rtcore.h>

#include <atomic>
#include <cmath>
#include <ctime>
#include <limits>

#include "tests/bench/bare_shapes.h"

namespace bench {
namespace {

using tracer::QuadricGeometry;
using tracer::SphereGeometry;

constexpr unsigned width = 16;
constexpr unsigned mask_opaque = 1, mask_transmissive = 2;

template <class Geometry>
void shape_bounds(const RTCBoundsFunctionArguments* args) {
  const auto [center, extent] = bounds_of(*static_cast<const Geometry*>(args->geometryUserPtr), args->primID);
  const auto low = [](double c) { return std::nextafter(static_cast<float>(c), -HUGE_VALF); };
  const auto high = [](double c) { return std::nextafter(static_cast<float>(c), HUGE_VALF); };
  const tracer::Vec3 from = center - extent, to = center + extent;
  *args->bounds_o = {low(from.x), low(from.y), low(from.z), 0, high(to.x), high(to.y), high(to.z), 0};
}

/// Calls `store(lane, distance, hit)` for the lanes of a packet. The distances have a loop of their own without
/// branches, which the compiler vectorizes.
template <class Geometry, class Store>
inline __attribute__((always_inline)) void each_lane(const Geometry& g, unsigned primitive, const RTCRay16& ray,
                                                     const Store& store) {
  alignas(64) double t[width];
  with_shape(
      g, primitive, [&](const auto& distance) __attribute__((always_inline)) {
        for (unsigned i = 0; i < width; ++i)
          t[i] = distance(
              {ray.org_x[i], ray.org_y[i], ray.org_z[i], ray.dir_x[i], ray.dir_y[i], ray.dir_z[i], ray.tnear[i]});
      });
  for (unsigned i = 0; i < width; ++i) store(i, t[i], t[i] < ray.tfar[i]);
}

template <class Geometry>
inline __attribute__((always_inline)) void closest_lanes(const Geometry& g, const RTCIntersectFunctionNArguments& args,
                                                         const int* valid, RTCRayHit16& rayhit) {
  const unsigned geometry = args.geomID, primitive = args.primID;
  each_lane(
      g, primitive, rayhit.ray, [&](unsigned i, double t, bool hit) __attribute__((always_inline)) {
        const bool accepted = hit & (valid[i] != 0);
        rayhit.ray.tfar[i] = accepted ? static_cast<float>(t) : rayhit.ray.tfar[i];
        rayhit.hit.geomID[i] = accepted ? geometry : rayhit.hit.geomID[i];
        rayhit.hit.primID[i] = accepted ? primitive : rayhit.hit.primID[i];
      });
}

template <class Geometry>
inline __attribute__((always_inline)) void occluded_lanes(const Geometry& g, unsigned primitive, const int* valid,
                                                          RTCRay16& ray) {
  each_lane(
      g, primitive, ray, [&](unsigned i, double /*t*/, bool hit) __attribute__((always_inline)) {
        ray.tfar[i] = hit & (valid[i] != 0) ? -std::numeric_limits<float>::infinity() : ray.tfar[i];
      });
}

/// Copies the rays of a partial packet to a full one.
RTCRay16 full_packet(RTCRayN* rays, unsigned count) {
  RTCRay16 packet{};
  for (unsigned i = 0; i < count; ++i) {
    const RTCRay ray = rtcGetRayFromRayN(rays, count, i);
    packet.org_x[i] = ray.org_x;
    packet.org_y[i] = ray.org_y;
    packet.org_z[i] = ray.org_z;
    packet.dir_x[i] = ray.dir_x;
    packet.dir_y[i] = ray.dir_y;
    packet.dir_z[i] = ray.dir_z;
    packet.tnear[i] = ray.tnear;
    packet.tfar[i] = ray.tfar;
  }
  return packet;
}

#define BARE_WIDE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))

BARE_WIDE void intersect(const SphereGeometry& g, const RTCIntersectFunctionNArguments& args, const int* valid,
                         RTCRayHit16& rayhit) {
  closest_lanes(g, args, valid, rayhit);
}
BARE_WIDE void intersect(const QuadricGeometry& g, const RTCIntersectFunctionNArguments& args, const int* valid,
                         RTCRayHit16& rayhit) {
  closest_lanes(g, args, valid, rayhit);
}
BARE_WIDE void occluded(const SphereGeometry& g, unsigned primitive, const int* valid, RTCRay16& ray) {
  occluded_lanes(g, primitive, valid, ray);
}
BARE_WIDE void occluded(const QuadricGeometry& g, unsigned primitive, const int* valid, RTCRay16& ray) {
  occluded_lanes(g, primitive, valid, ray);
}

template <class Geometry>
void shape_intersect(const RTCIntersectFunctionNArguments* args) {
  const auto& g = *static_cast<const Geometry*>(args->geometryUserPtr);
  if (args->N == width) {
    intersect(g, *args, args->valid, *reinterpret_cast<RTCRayHit16*>(args->rayhit));
    return;
  }
  RTCRayN* rays = RTCRayHitN_RayN(args->rayhit, args->N);
  RTCRayHit16 packet;
  packet.ray = full_packet(rays, args->N);
  int valid[width] = {};
  for (unsigned i = 0; i < args->N; ++i) valid[i] = args->valid[i];
  for (unsigned& id : packet.hit.geomID) id = RTC_INVALID_GEOMETRY_ID;
  intersect(g, *args, valid, packet);
  for (unsigned i = 0; i < args->N; ++i) {
    if (packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
    RTCRayN_tfar(rays, args->N, i) = packet.ray.tfar[i];
    RTCHitN_geomID(RTCRayHitN_HitN(args->rayhit, args->N), args->N, i) = args->geomID;
    RTCHitN_primID(RTCRayHitN_HitN(args->rayhit, args->N), args->N, i) = args->primID;
  }
}

template <class Geometry>
void shape_occluded(const RTCOccludedFunctionNArguments* args) {
  const auto& g = *static_cast<const Geometry*>(args->geometryUserPtr);
  if (args->N == width) {
    occluded(g, args->primID, args->valid, *reinterpret_cast<RTCRay16*>(args->ray));
    return;
  }
  RTCRay16 packet = full_packet(args->ray, args->N);
  int valid[width] = {};
  for (unsigned i = 0; i < args->N; ++i) valid[i] = args->valid[i];
  occluded(g, args->primID, valid, packet);
  for (unsigned i = 0; i < args->N; ++i) RTCRayN_tfar(args->ray, args->N, i) = packet.tfar[i];
}

unsigned mask_of(tracer::GeometryMask mask) {
  return (mask != tracer::GeometryMask::transmissive ? mask_opaque : 0) |
         (mask != tracer::GeometryMask::opaque ? mask_transmissive : 0);
}

/// Converts rays to an Embree packet; lanes beyond the last ray repeat it.
RTCRay16 packet(const tracer::RaySpan& rays, std::size_t first, unsigned mask) {
  RTCRay16 ray;
  for (std::size_t i = 0; i < width; ++i) {
    const std::size_t k = std::min(first + i, rays.count - 1);
    ray.org_x[i] = static_cast<float>(rays.ox[k]);
    ray.org_y[i] = static_cast<float>(rays.oy[k]);
    ray.org_z[i] = static_cast<float>(rays.oz[k]);
    ray.dir_x[i] = static_cast<float>(rays.dx[k]);
    ray.dir_y[i] = static_cast<float>(rays.dy[k]);
    ray.dir_z[i] = static_cast<float>(rays.dz[k]);
    ray.tnear[i] = 1e-5f;
    ray.tfar[i] = rays.t_max != nullptr ? static_cast<float>(rays.t_max[k]) : HUGE_VALF;
    ray.time[i] = 0;
    ray.mask[i] = mask;
    ray.id[i] = static_cast<unsigned>(i);
    ray.flags[i] = 0;
  }
  return ray;
}

bool is_hit(const RTCRay16& ray, unsigned lane) { return ray.tfar[lane] < 0; }
bool is_hit(const RTCRayHit16& rayhit, unsigned lane) { return rayhit.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID; }

void set_rays(const RTCRay16& ray, RTCRay16& target) { target = ray; }
void set_rays(const RTCRay16& ray, RTCRayHit16& target) {
  target.ray = ray;
  for (unsigned& id : target.hit.geomID) id = RTC_INVALID_GEOMETRY_ID;
}

void run_query(const int* valid, RTCScene scene, RTCIntersectContext& context, RTCRay16& ray) {
  rtcOccluded16(valid, scene, &context, &ray);
}
void run_query(const int* valid, RTCScene scene, RTCIntersectContext& context, RTCRayHit16& rayhit) {
  rtcIntersect16(valid, scene, &context, &rayhit);
}

struct Scenes {
  RTCScene all = nullptr;
  RTCScene transmissive = nullptr;  ///< the transmissive geometry again
};

/// Traces all queries of one kind; `Rays` is RTCRay16 or RTCRayHit16.
template <class Rays>
BareEmbree::Timing trace_all(std::span<const Query> queries, Query::Kind kind, BareEmbree::Flags flags,
                             const Scenes& scenes) {
  struct Packet {
    Rays rays;
    alignas(64) int valid[width];
    tracer::Coherence coherence;
    RTCScene scene;
  };
  std::vector<Packet> packets;
  for (const Query& query : queries) {
    if (query.kind != kind) continue;
    const tracer::RaySpan rays = query.rays();
    for (std::size_t first = 0; first < rays.count; first += width) {
      Packet& filled = packets.emplace_back();
      set_rays(packet(rays, first, mask_of(query.mask)), filled.rays);
      filled.scene = query.mask == tracer::GeometryMask::transmissive ? scenes.transmissive : scenes.all;
      for (std::size_t i = 0; i < width; ++i)
        filled.valid[i] = first + i < rays.count && Query::is_ray(rays, first + i) ? -1 : 0;
      filled.coherence = flags == BareEmbree::Flags::as_recorded ? query.coherence : tracer::Coherence::coherent;
    }
  }
  RTCIntersectContext coherent, incoherent;
  rtcInitIntersectContext(&coherent);
  rtcInitIntersectContext(&incoherent);
  coherent.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  incoherent.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  BareEmbree::Timing timing;
  const double start = processor_seconds();
  for (Packet& packet : packets)
    run_query(packet.valid, packet.scene, packet.coherence == tracer::Coherence::coherent ? coherent : incoherent,
              packet.rays);
  timing.seconds = processor_seconds() - start;
  for (const Packet& packet : packets)
    for (unsigned i = 0; i < width; ++i) timing.hits += packet.valid[i] != 0 && is_hit(packet.rays, i) ? 1 : 0;
  return timing;
}

}  // namespace

double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

struct BareEmbree::Content {
  std::atomic<std::int64_t> bytes{0};  ///< allocated by Embree
  RTCDevice device = rtcNewDevice(nullptr);
  Scenes scenes;
  std::uint64_t shared_bytes = 0;  ///< geometry that Embree shares
  Content() {
    const auto count = [](void* total, ssize_t more, bool /*post*/) {
      *static_cast<std::atomic<std::int64_t>*>(total) += more;
      return true;
    };
    rtcSetDeviceMemoryMonitorFunction(device, count, &bytes);
    scenes = {rtcNewScene(device), rtcNewScene(device)};
  }
  Content(const Content&) = delete;
  Content& operator=(const Content&) = delete;
  ~Content() {
    rtcReleaseScene(scenes.transmissive);
    rtcReleaseScene(scenes.all);
    rtcReleaseDevice(device);
  }
  void attach(RTCGeometry geometry, bool transmissive) const {
    rtcSetGeometryMask(geometry, transmissive ? mask_transmissive : mask_opaque);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scenes.all, geometry);
    if (transmissive) rtcAttachGeometry(scenes.transmissive, geometry);
    rtcReleaseGeometry(geometry);
  }
  /// Two triangles large enough to look like an infinite plane.
  void attach_plane(const tracer::Vec3& point, const tracer::Vec3& normal, bool transmissive) const {
    constexpr double far = 50;  // the bounds of the scene are about 1
    const tracer::Axes axes = tracer::axes_across(normal, {0, 1, 0});
    RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(
        rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), 4));
    for (const auto& [along, across] : {std::pair{-far, -far}, {far, -far}, {far, far}, {-far, far}}) {
      const tracer::Vec3 corner = point + axes.e0 * along + axes.e1 * across;
      for (const double coordinate : {corner.x, corner.y, corner.z}) *vertices++ = static_cast<float>(coordinate);
    }
    auto* indices = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), 2));
    for (const unsigned index : {0u, 1u, 2u, 0u, 2u, 3u}) *indices++ = index;
    attach(g, transmissive);
  }
  template <class Geometry>
  void attach_shapes(const Geometry& shapes) const {
    RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(g, static_cast<unsigned>(shapes.object.size()));
    rtcSetGeometryUserData(g, const_cast<Geometry*>(&shapes));
    rtcSetGeometryBoundsFunction(g, shape_bounds<Geometry>, nullptr);
    rtcSetGeometryIntersectFunction(g, shape_intersect<Geometry>);
    rtcSetGeometryOccludedFunction(g, shape_occluded<Geometry>);
    attach(g, shapes.transmissive);
  }
};

BareEmbree::BareEmbree(const tracer::GeometrySet& geometry) : content_(std::make_unique<Content>()) {
  content_->shared_bytes = tracer::memory_bytes(geometry);
  for (const SphereGeometry& spheres : geometry.spheres) content_->attach_shapes(spheres);
  for (const QuadricGeometry& quadrics : geometry.quadrics) content_->attach_shapes(quadrics);
  for (const tracer::TriangleGeometry& mesh : geometry.triangles) {
    RTCGeometry g = rtcNewGeometry(content_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                 3 * sizeof(float), mesh.positions.size()));
    content_->shared_bytes -= mesh.positions.capacity() * sizeof(tracer::Vec3);
    for (const tracer::Vec3& p : mesh.positions)
      for (const double coordinate : {p.x, p.y, p.z}) *vertices++ = static_cast<float>(coordinate);
    rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.triangles.data(), 0,
                               3 * sizeof(std::uint32_t), mesh.triangles.size());
    content_->attach(g, mesh.transmissive);
  }
  const tracer::PlaneGeometry& planes = geometry.planes;
  for (std::size_t i = 0; i < planes.point.size(); ++i)
    content_->attach_plane(planes.point[i], planes.normal[i], planes.transmissive[i] != 0);
  rtcCommitScene(content_->scenes.all);
  rtcCommitScene(content_->scenes.transmissive);
}

BareEmbree::~BareEmbree() = default;

std::uint64_t BareEmbree::memory_bytes() const {
  return static_cast<std::uint64_t>(content_->bytes.load()) + content_->shared_bytes;
}

BareEmbree::Timing BareEmbree::trace(std::span<const Query> queries, Query::Kind kind, Flags flags) const {
  return kind == Query::Kind::intersect ? trace_all<RTCRayHit16>(queries, kind, flags, content_->scenes)
                                        : trace_all<RTCRay16>(queries, kind, flags, content_->scenes);
}

}  // namespace bench
