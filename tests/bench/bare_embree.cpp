#include "tests/bench/bare_embree.h"

#include <embree3/rtcore.h>

#include <atomic>
#include <ctime>

namespace bench {
namespace {

constexpr unsigned width = 16;
constexpr unsigned mask_opaque = 1, mask_transmissive = 2;

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
double trace_all(std::span<const Query> queries, Query::Kind kind, BareEmbree::Flags flags, const Scenes& scenes) {
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
  const double start = processor_seconds();
  for (Packet& packet : packets)
    run_query(packet.valid, packet.scene, packet.coherence == tracer::Coherence::coherent ? coherent : incoherent,
              packet.rays);
  return processor_seconds() - start;
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
  void attach_spheres(const tracer::SphereGeometry& spheres) const {
    RTCGeometry g = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4,
                                                                 4 * sizeof(float), spheres.radius.size()));
    for (std::size_t i = 0; i < spheres.radius.size(); ++i)
      for (const auto* values : {&spheres.x, &spheres.y, &spheres.z, &spheres.radius})
        *vertices++ = static_cast<float>((*values)[i]);
    attach(g, spheres.transmissive);
  }
};

BareEmbree::BareEmbree(const tracer::GeometrySet& geometry) : content_(std::make_unique<Content>()) {
  content_->shared_bytes = tracer::memory_bytes(geometry);
  for (const tracer::SphereGeometry& spheres : geometry.spheres) {
    content_->shared_bytes -= 4 * spheres.radius.capacity() * sizeof(double);
    content_->attach_spheres(spheres);
  }
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

double BareEmbree::trace_seconds(std::span<const Query> queries, Query::Kind kind, Flags flags) const {
  return kind == Query::Kind::intersect ? trace_all<RTCRayHit16>(queries, kind, flags, content_->scenes)
                                        : trace_all<RTCRay16>(queries, kind, flags, content_->scenes);
}

}  // namespace bench
