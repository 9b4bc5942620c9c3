#include "tests/bench/bare_embree.h"

#include <embree3/rtcore.h>

#include <chrono>
#include <cmath>
#include <limits>

namespace bench {
namespace {

using tracer::SphereGeometry;

constexpr unsigned width = 16;

void sphere_bounds(const RTCBoundsFunctionArguments* args) {
  const auto& g = *static_cast<const SphereGeometry*>(args->geometryUserPtr);
  const unsigned i = args->primID;
  const auto low = [&](double c) { return std::nextafter(static_cast<float>(c - g.radius[i]), -HUGE_VALF); };
  const auto high = [&](double c) { return std::nextafter(static_cast<float>(c + g.radius[i]), HUGE_VALF); };
  *args->bounds_o = {low(g.x[i]), low(g.y[i]), low(g.z[i]), 0, high(g.x[i]), high(g.y[i]), high(g.z[i]), 0};
}

/// The textbook callback in double, over the lanes of a packet without branches. `Store` gets (lane, t, hit).
template <class Store>
inline __attribute__((always_inline)) void sphere_lanes(const SphereGeometry& g, unsigned primitive,
                                                        const RTCRay16& ray, const Store& store) {
  const double x = g.x[primitive], y = g.y[primitive], z = g.z[primitive];
  const double squared = g.radius[primitive] * g.radius[primitive];
  for (unsigned i = 0; i < width; ++i) {
    const double fx = ray.org_x[i] - x, fy = ray.org_y[i] - y, fz = ray.org_z[i] - z;
    const double dx = ray.dir_x[i], dy = ray.dir_y[i], dz = ray.dir_z[i];
    const double a = dx * dx + dy * dy + dz * dz;
    const double b = -(fx * dx + fy * dy + fz * dz);
    const double c = fx * fx + fy * fy + fz * fz - squared;
    const double discriminant = b * b - a * c;
    const double root = std::sqrt(discriminant > 0 ? discriminant : 0);
    const double near = (b - root) / a, far = (b + root) / a;
    const double t = near > ray.tnear[i] ? near : far;
    store(i, t, (discriminant >= 0) & (t > ray.tnear[i]) & (t < ray.tfar[i]));
  }
}

__attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default"))) void closest_lanes(
    const SphereGeometry& g, unsigned primitive, unsigned geometry, const int* valid, RTCRayHit16& rayhit) {
  sphere_lanes(g, primitive, rayhit.ray, [&](unsigned i, double t, bool hit) {
    const bool taken = hit & (valid[i] != 0);
    rayhit.ray.tfar[i] = taken ? static_cast<float>(t) : rayhit.ray.tfar[i];
    rayhit.hit.geomID[i] = taken ? geometry : rayhit.hit.geomID[i];
    rayhit.hit.primID[i] = taken ? primitive : rayhit.hit.primID[i];
  });
}

__attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default"))) void occluded_lanes(
    const SphereGeometry& g, unsigned primitive, const int* valid, RTCRay16& ray) {
  sphere_lanes(g, primitive, ray, [&](unsigned i, double /*t*/, bool hit) {
    ray.tfar[i] = hit & (valid[i] != 0) ? -std::numeric_limits<float>::infinity() : ray.tfar[i];
  });
}

void sphere_intersect(const RTCIntersectFunctionNArguments* args) {
  const auto& g = *static_cast<const SphereGeometry*>(args->geometryUserPtr);
  if (args->N == width) {
    closest_lanes(g, args->primID, args->geomID, args->valid, *reinterpret_cast<RTCRayHit16*>(args->rayhit));
    return;
  }
  for (unsigned i = 0; i < args->N; ++i) {
    if (args->valid[i] == 0) continue;
    RTCRayHit16 one;
    int valid[width] = {-1};
    RTCRayHit single = rtcGetRayHitFromRayHitN(args->rayhit, args->N, i);
    for (unsigned k = 0; k < width; ++k) {
      one.ray.org_x[k] = single.ray.org_x;
      one.ray.org_y[k] = single.ray.org_y;
      one.ray.org_z[k] = single.ray.org_z;
      one.ray.dir_x[k] = single.ray.dir_x;
      one.ray.dir_y[k] = single.ray.dir_y;
      one.ray.dir_z[k] = single.ray.dir_z;
      one.ray.tnear[k] = single.ray.tnear;
      one.ray.tfar[k] = single.ray.tfar;
    }
    one.hit.geomID[0] = RTC_INVALID_GEOMETRY_ID;
    closest_lanes(g, args->primID, args->geomID, valid, one);
    if (one.hit.geomID[0] == RTC_INVALID_GEOMETRY_ID) continue;
    single.ray.tfar = one.ray.tfar[0];
    single.hit.geomID = args->geomID;
    single.hit.primID = args->primID;
    rtcCopyHitToHitN(RTCRayHitN_HitN(args->rayhit, args->N), &single.hit, args->N, i);
    RTCRayN_tfar(RTCRayHitN_RayN(args->rayhit, args->N), args->N, i) = single.ray.tfar;
  }
}

void sphere_occluded(const RTCOccludedFunctionNArguments* args) {
  const auto& g = *static_cast<const SphereGeometry*>(args->geometryUserPtr);
  if (args->N == width) {
    occluded_lanes(g, args->primID, args->valid, *reinterpret_cast<RTCRay16*>(args->ray));
    return;
  }
  for (unsigned i = 0; i < args->N; ++i) {
    if (args->valid[i] == 0) continue;
    const RTCRay single = rtcGetRayFromRayN(args->ray, args->N, i);
    RTCRay16 one;
    int valid[width] = {-1};
    for (unsigned k = 0; k < width; ++k) {
      one.org_x[k] = single.org_x;
      one.org_y[k] = single.org_y;
      one.org_z[k] = single.org_z;
      one.dir_x[k] = single.dir_x;
      one.dir_y[k] = single.dir_y;
      one.dir_z[k] = single.dir_z;
      one.tnear[k] = single.tnear;
      one.tfar[k] = single.tfar;
    }
    occluded_lanes(g, args->primID, valid, one);
    RTCRayN_tfar(args->ray, args->N, i) = one.tfar[0];
  }
}

RTCRay16 packet(const tracer::RaySpan& rays, std::size_t first) {
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
    ray.mask[i] = ~0u;
    ray.id[i] = static_cast<unsigned>(i);
    ray.flags[i] = 0;
  }
  return ray;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

struct BareEmbree::Content {
  RTCDevice device = rtcNewDevice(nullptr);
  RTCScene scene = rtcNewScene(device);
  Content() = default;
  Content(const Content&) = delete;
  Content& operator=(const Content&) = delete;
  ~Content() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }
  void attach(RTCGeometry geometry) const {
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
  }
};

BareEmbree::BareEmbree(const tracer::GeometrySet& geometry) : content_(std::make_unique<Content>()) {
  for (const SphereGeometry& spheres : geometry.spheres) {
    RTCGeometry g = rtcNewGeometry(content_->device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(g, static_cast<unsigned>(spheres.x.size()));
    rtcSetGeometryUserData(g, const_cast<SphereGeometry*>(&spheres));
    rtcSetGeometryBoundsFunction(g, sphere_bounds, nullptr);
    rtcSetGeometryIntersectFunction(g, sphere_intersect);
    rtcSetGeometryOccludedFunction(g, sphere_occluded);
    content_->attach(g);
  }
  for (const tracer::TriangleGeometry& mesh : geometry.triangles) {
    RTCGeometry g = rtcNewGeometry(content_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                 3 * sizeof(float), mesh.positions.size()));
    for (const tracer::Vec3& p : mesh.positions)
      for (const double coordinate : {p.x, p.y, p.z}) *vertices++ = static_cast<float>(coordinate);
    rtcSetSharedGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, mesh.triangles.data(), 0,
                               3 * sizeof(std::uint32_t), mesh.triangles.size());
    content_->attach(g);
  }
  rtcCommitScene(content_->scene);
}

BareEmbree::~BareEmbree() = default;

BareEmbree::Timing BareEmbree::closest(const tracer::RaySpan& rays) const {
  std::vector<RTCRayHit16> packets((rays.count + width - 1) / width);
  for (std::size_t p = 0; p < packets.size(); ++p) {
    packets[p].ray = packet(rays, p * width);
    for (unsigned& id : packets[p].hit.geomID) id = RTC_INVALID_GEOMETRY_ID;
  }
  const int valid[width] = {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  Timing timing{.rays = rays.count};
  const auto start = std::chrono::steady_clock::now();
  for (RTCRayHit16& p : packets) rtcIntersect16(valid, content_->scene, &context, &p);
  timing.seconds = seconds_since(start);
  for (std::size_t i = 0; i < rays.count; ++i)
    timing.hits += packets[i / width].hit.geomID[i % width] != RTC_INVALID_GEOMETRY_ID ? 1 : 0;
  return timing;
}

BareEmbree::Timing BareEmbree::occluded(const tracer::RaySpan& rays) const {
  std::vector<RTCRay16> packets((rays.count + width - 1) / width);
  for (std::size_t p = 0; p < packets.size(); ++p) packets[p] = packet(rays, p * width);
  const int valid[width] = {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  Timing timing{.rays = rays.count};
  const auto start = std::chrono::steady_clock::now();
  for (RTCRay16& p : packets) rtcOccluded16(valid, content_->scene, &context, &p);
  timing.seconds = seconds_since(start);
  for (std::size_t i = 0; i < rays.count; ++i) timing.hits += packets[i / width].tfar[i % width] < 0 ? 1 : 0;
  return timing;
}

}  // namespace bench
