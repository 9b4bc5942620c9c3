#include <atomic>

#include "tracer/src/accel/packet.h"

namespace tracer {
namespace {

constexpr unsigned mask_opaque = 1, mask_transmissive = 2, mask_all = 3;

/// What a callback needs to find its geometry.
struct SphereUser {
  const SphereGeometry* geometry;
  std::uint32_t index;
};
struct TriangleUser {
  const TriangleGeometry* geometry;
  std::uint32_t index;
};

struct QuadricUser {
  const QuadricGeometry* geometry;
  std::uint32_t index;
};

SphereTest sphere_test(const SphereGeometry& g, unsigned primitive) {
  return {g.x[primitive], g.y[primitive], g.z[primitive], g.radius[primitive]};
}

/// Box in float that surely holds [low, high] as Embree's float rays see it. They are wrong by some 2^-24 of the
/// scene's box (about one) wherever they are, so the pad is absolute: relative to a primitive near 0 it would be
/// nothing. Embree's own box tests round too, and its robust mode does not reach user geometry.
void write_bounds(const Vec3& low, const Vec3& high, RTCBounds& bounds) {
  constexpr double pad = 0x1p-22;
  bounds.lower_x = static_cast<float>(low.x - pad);
  bounds.lower_y = static_cast<float>(low.y - pad);
  bounds.lower_z = static_cast<float>(low.z - pad);
  bounds.upper_x = static_cast<float>(high.x + pad);
  bounds.upper_y = static_cast<float>(high.y + pad);
  bounds.upper_z = static_cast<float>(high.z + pad);
}

void sphere_bounds(const RTCBoundsFunctionArguments* args) {
  const SphereTest s = sphere_test(*static_cast<const SphereUser*>(args->geometryUserPtr)->geometry, args->primID);
  const Vec3 center{s.x, s.y, s.z}, r{s.radius, s.radius, s.radius};
  write_bounds(center - r, center + r, *args->bounds_o);
}

void sphere_intersect(const RTCIntersectFunctionNArguments* args) {
  const auto& user = *static_cast<const SphereUser*>(args->geometryUserPtr);
  Packet& packet = Packet::of(args->context);
  const SphereTest sphere = sphere_test(*user.geometry, args->primID);
  const PrimitiveRef self{user.index, args->primID};
  RTCRayN* rays = RTCRayHitN_RayN(args->rayhit, args->N);
  if (args->N == packet_size) {
    closest_sphere(packet, args->valid, &RTCRayN_tfar(rays, packet_size, 0), sphere, self);
    return;
  }
  for (unsigned i = 0; i < args->N; ++i)
    if (args->valid[i] != 0)
      closest_sphere_lane(packet, RTCRayN_id(rays, args->N, i), RTCRayN_tfar(rays, args->N, i), sphere, self);
}

void sphere_occluded(const RTCOccludedFunctionNArguments* args) {
  const auto& user = *static_cast<const SphereUser*>(args->geometryUserPtr);
  const Packet& packet = Packet::of(args->context);
  const SphereTest sphere = sphere_test(*user.geometry, args->primID);
  if (args->N == packet_size) {
    occluded_sphere(packet, args->valid, &RTCRayN_tfar(args->ray, packet_size, 0), sphere);
    return;
  }
  for (unsigned i = 0; i < args->N; ++i)
    if (args->valid[i] != 0)
      occluded_sphere_lane(packet, RTCRayN_id(args->ray, args->N, i), RTCRayN_tfar(args->ray, args->N, i), sphere);
}

void quadric_bounds(const RTCBoundsFunctionArguments* args) {
  const Quadric& q = static_cast<const QuadricUser*>(args->geometryUserPtr)->geometry->quadrics[args->primID];
  Bounds bounds;
  const auto include = [&](const Vec3& shape_center, const Vec3& extent) {
    const Vec3 center = q.origin + q.trace_from_shape * shape_center;
    bounds.include(center - extent);
    bounds.include(center + extent);
  };
  const Linear& m = q.trace_from_shape;
  switch (q.kind) {
    case QuadricKind::ellipsoid:
      include({}, ellipsoid_extent(m));
      break;
    case QuadricKind::disc:
      include({}, disc_extent(m));
      break;
    case QuadricKind::frustum:
      include({}, disc_extent(m) * q.radius_0);
      include({0, 0, 1}, disc_extent(m) * q.radius_1);
      break;
    case QuadricKind::box:
      include({0.5, 0.5, 0.5}, (abs(m.x) + abs(m.y) + abs(m.z)) * 0.5);
      break;
  }
  write_bounds(bounds.low, bounds.high, *args->bounds_o);
}

void quadric_intersect(const RTCIntersectFunctionNArguments* args) {
  const auto& user = *static_cast<const QuadricUser*>(args->geometryUserPtr);
  Packet& packet = Packet::of(args->context);
  const Quadric& quadric = user.geometry->quadrics[args->primID];
  const PrimitiveRef self{user.index, args->primID};
  RTCRayN* rays = RTCRayHitN_RayN(args->rayhit, args->N);
  if (args->N == packet_size) {
    closest_quadric(packet, args->valid, &RTCRayN_tfar(rays, packet_size, 0), quadric, self);
    return;
  }
  for (unsigned i = 0; i < args->N; ++i)
    if (args->valid[i] != 0)
      closest_quadric_lane(packet, RTCRayN_id(rays, args->N, i), RTCRayN_tfar(rays, args->N, i), quadric, self);
}

void quadric_occluded(const RTCOccludedFunctionNArguments* args) {
  const auto& user = *static_cast<const QuadricUser*>(args->geometryUserPtr);
  const Packet& packet = Packet::of(args->context);
  const Quadric& quadric = user.geometry->quadrics[args->primID];
  if (args->N == packet_size) {
    occluded_quadric(packet, args->valid, &RTCRayN_tfar(args->ray, packet_size, 0), quadric);
    return;
  }
  for (unsigned i = 0; i < args->N; ++i)
    if (args->valid[i] != 0)
      occluded_quadric_lane(packet, RTCRayN_id(args->ray, args->N, i), RTCRayN_tfar(args->ray, args->N, i), quadric);
}

/// Embree found these lanes to hit in float; decide in double.
void triangle_intersect_filter(const RTCFilterFunctionNArguments* args) {
  const auto& user = *static_cast<const TriangleUser*>(args->geometryUserPtr);
  Packet& packet = Packet::of(args->context);
  for (unsigned i = 0; i < args->N; ++i) {
    if (args->valid[i] == 0) continue;
    const unsigned primitive = RTCHitN_primID(args->hit, args->N, i);
    if (!closest_triangle_lane(packet, RTCRayN_id(args->ray, args->N, i), RTCRayN_tfar(args->ray, args->N, i),
                               *user.geometry, {user.index, primitive}))
      args->valid[i] = 0;
  }
}

void triangle_occluded_filter(const RTCFilterFunctionNArguments* args) {
  const auto& user = *static_cast<const TriangleUser*>(args->geometryUserPtr);
  const Packet& packet = Packet::of(args->context);
  for (unsigned i = 0; i < args->N; ++i) {
    if (args->valid[i] == 0) continue;
    const unsigned primitive = RTCHitN_primID(args->hit, args->N, i);
    if (!occluded_triangle_lane(packet, RTCRayN_id(args->ray, args->N, i), *user.geometry, {user.index, primitive}))
      args->valid[i] = 0;
  }
}

struct UserFunctions {
  RTCBoundsFunction bounds;
  RTCIntersectFunctionN intersect;
  RTCOccludedFunctionN occluded;
};

bool count_memory(void* total, ssize_t bytes, bool /*post*/) {
  static_cast<std::atomic<std::int64_t>*>(total)->fetch_add(bytes, std::memory_order_relaxed);
  return true;
}

bool keep_building(void* control, double /*fraction*/) { return !static_cast<RenderControl*>(control)->cancelled(); }

}  // namespace

struct Accelerator::Embree {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  Bounds box;
  std::vector<SphereUser> spheres;
  std::vector<TriangleUser> triangles;
  std::vector<QuadricUser> quadrics;
  std::atomic<std::int64_t> bytes{0};

  Embree() : device(rtcNewDevice(nullptr)) {
    if (device == nullptr) return;
    rtcSetDeviceMemoryMonitorFunction(device, count_memory, &bytes);
    scene = rtcNewScene(device);
  }
  ~Embree() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
  Embree(const Embree&) = delete;
  Embree& operator=(const Embree&) = delete;

  void add(const SphereGeometry& added, std::uint32_t index);
  void add(const TriangleGeometry& added, std::uint32_t index);
  void add(const QuadricGeometry& added, std::uint32_t index);
  void add_user(const UserFunctions& functions, void* user, std::size_t count, bool transmissive, std::uint32_t index);
  void attach(RTCGeometry geometry, bool transmissive, std::uint32_t index);
  void include(const RTCBounds& b) {
    box.include({b.lower_x, b.lower_y, b.lower_z});
    box.include({b.upper_x, b.upper_y, b.upper_z});
  }
};

void Accelerator::Embree::attach(RTCGeometry geometry, bool transmissive, std::uint32_t index) {
  rtcSetGeometryMask(geometry, transmissive ? mask_transmissive : mask_opaque);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, index);
  rtcReleaseGeometry(geometry);
}

void Accelerator::Embree::add_user(const UserFunctions& functions, void* user, std::size_t count, bool transmissive,
                                   std::uint32_t index) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
  rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(count));
  rtcSetGeometryUserData(geometry, user);
  rtcSetGeometryBoundsFunction(geometry, functions.bounds, nullptr);
  rtcSetGeometryIntersectFunction(geometry, functions.intersect);
  rtcSetGeometryOccludedFunction(geometry, functions.occluded);
  attach(geometry, transmissive, index);
  for (unsigned i = 0; i < count; ++i) {
    RTCBounds bounds;
    const RTCBoundsFunctionArguments args{user, i, 0, &bounds};
    functions.bounds(&args);
    include(bounds);
  }
}

void Accelerator::Embree::add(const SphereGeometry& added, std::uint32_t index) {
  spheres.push_back({&added, index});
  add_user({sphere_bounds, sphere_intersect, sphere_occluded}, &spheres.back(), added.x.size(), added.transmissive,
           index);
}

void Accelerator::Embree::add(const QuadricGeometry& added, std::uint32_t index) {
  quadrics.push_back({&added, index});
  add_user({quadric_bounds, quadric_intersect, quadric_occluded}, &quadrics.back(), added.quadrics.size(),
           added.transmissive, index);
}

void Accelerator::Embree::add(const TriangleGeometry& added, std::uint32_t index) {
  triangles.push_back({&added, index});
  const std::size_t vertices = (added.positions.size() - 4) / 3;
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, added.positions.data(), 0,
                             3 * sizeof(float), vertices);
  rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, added.triangles.data(), 0,
                             3 * sizeof(std::uint32_t), added.triangles.size());
  rtcSetGeometryUserData(geometry, &triangles.back());
  rtcSetGeometryIntersectFilterFunction(geometry, triangle_intersect_filter);
  rtcSetGeometryOccludedFilterFunction(geometry, triangle_occluded_filter);
  attach(geometry, added.transmissive, index);
  for (std::size_t i = 0; i < vertices; ++i) box.include(added.position(static_cast<std::uint32_t>(i)));
}

Accelerator::Accelerator(const GeometrySet& geometry, std::unique_ptr<Embree> embree)
    : geometry_(geometry), embree_(std::move(embree)) {}
Accelerator::~Accelerator() = default;

Result<std::unique_ptr<Accelerator>, Failure> Accelerator::build(const GeometrySet& geometry, RenderControl& control) {
  auto embree = std::make_unique<Embree>();
  if (embree->scene == nullptr) return Failure{Failure::Code::internal, "Embree cannot start on this machine"};
  // Pointers to these are handed to Embree: they must not move.
  embree->spheres.reserve(geometry.spheres.size());
  embree->triangles.reserve(geometry.triangles.size());
  embree->quadrics.reserve(geometry.quadrics.size());
  for (std::uint32_t i = 0; i < geometry.spheres.size(); ++i) embree->add(geometry.spheres[i], i);
  for (std::uint32_t i = 0; i < geometry.triangles.size(); ++i)
    embree->add(geometry.triangles[i], geometry.first_triangles() + i);
  for (std::uint32_t i = 0; i < geometry.quadrics.size(); ++i)
    embree->add(geometry.quadrics[i], geometry.first_quadrics() + i);
  if (!embree->box.empty()) {
    const Vec3 pad{0x1p-18, 0x1p-18, 0x1p-18};
    embree->box = {embree->box.low - pad, embree->box.high + pad};
  }
  rtcSetSceneFlags(embree->scene, RTC_SCENE_FLAG_ROBUST);
  rtcSetSceneProgressMonitorFunction(embree->scene, keep_building, &control);
  rtcCommitScene(embree->scene);
  const RTCError error = rtcGetDeviceError(embree->device);
  if (error == RTC_ERROR_CANCELLED) return Failure{Failure::Code::cancelled, "cancelled while building"};
  if (error == RTC_ERROR_OUT_OF_MEMORY) return Failure{Failure::Code::out_of_memory, "no memory for the BVH"};
  if (error != RTC_ERROR_NONE) return Failure{Failure::Code::internal, "Embree could not build the BVH"};
  rtcSetSceneProgressMonitorFunction(embree->scene, nullptr, nullptr);
  return std::unique_ptr<Accelerator>(new Accelerator(geometry, std::move(embree)));
}

void Accelerator::closest(const RaySpan& rays, const HitSpan& hits, Coherence coherence, Among among) const {
  Packet packet;
  RTCRayHit16 rayhit;
  for (std::size_t first = 0; first < rays.count; first += packet_size) {
    const int count = static_cast<int>(std::min<std::size_t>(packet_size, rays.count - first));
    load(packet, rays, first, count, embree_->box);
    closest_planes(packet, count, geometry_.planes, geometry_.plane_geometry(), among);
    write_rays(packet, among == Among::all ? mask_all : mask_transmissive, rayhit.ray);
    std::fill_n(rayhit.hit.geomID, packet_size, RTC_INVALID_GEOMETRY_ID);
    rtcInitIntersectContext(&packet.context);
    packet.context.flags =
        coherence == Coherence::coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    rtcIntersect16(packet.active, embree_->scene, &packet.context, &rayhit);
    for (int i = 0; i < count; ++i) {
      hits.primitive[first + i] = {packet.geometry[i], packet.primitive[i]};
      hits.t[first + i] = packet.t[i];
      hits.u[first + i] = packet.u[i];
      hits.v[first + i] = packet.v[i];
    }
  }
}

void Accelerator::occluded(const RaySpan& rays, std::uint8_t* blocked, Coherence coherence) const {
  Packet packet;
  RTCRay16 ray;
  for (std::size_t first = 0; first < rays.count; first += packet_size) {
    const int count = static_cast<int>(std::min<std::size_t>(packet_size, rays.count - first));
    load(packet, rays, first, count, embree_->box);
    std::uint8_t* answer = blocked + first;
    std::fill_n(answer, count, std::uint8_t{0});
    occluded_planes(packet, count, geometry_.planes, geometry_.plane_geometry(), answer);
    for (int i = 0; i < count; ++i) packet.active[i] = answer[i] != 0 ? 0 : packet.active[i];
    write_rays(packet, mask_opaque, ray);
    rtcInitIntersectContext(&packet.context);
    packet.context.flags =
        coherence == Coherence::coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    rtcOccluded16(packet.active, embree_->scene, &packet.context, &ray);
    for (int i = 0; i < count; ++i) answer[i] |= static_cast<std::uint8_t>(packet.active[i] != 0 && ray.tfar[i] < 0);
  }
}

std::uint64_t Accelerator::memory_bytes() const { return static_cast<std::uint64_t>(embree_->bytes.load()); }

}  // namespace tracer
