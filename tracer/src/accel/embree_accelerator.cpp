#include <atomic>

#include "tracer/src/accel/packet.h"
#include "tracer/src/accel/primitive_bounds.h"

#if defined(__SANITIZE_THREAD__)
#include <sanitizer/tsan_interface.h>
#endif

#if defined(WHITTLE_AVX2)
#define WHITTLE_EMBREE_ISA "isa=avx2,"
#else
#define WHITTLE_EMBREE_ISA ""
#endif

namespace tracer {
namespace {

/// Annotations for ThreadSanitizer. Embree's threads synchronize with the thread that commits the scene, before and
/// after they build the tree, but Embree's library is not instrumented.
void release([[maybe_unused]] void* object) {
#if defined(__SANITIZE_THREAD__)
  __tsan_release(object);
#endif
}
void acquire([[maybe_unused]] void* object) {
#if defined(__SANITIZE_THREAD__)
  __tsan_acquire(object);
#endif
}

unsigned bits_of(GeometryMask mask) { return static_cast<unsigned>(mask); }

/// User data of an Embree geometry.
template <class Geometry>
struct User {
  const Geometry* geometry;
  PrimitiveGroups<Geometry> groups;
};

/// Float box of the group for Embree's float rays. Their error is about 2^-24 of the scene's box (about one) wherever
/// they are, so the padding is absolute: relative to a primitive near 0 it would vanish. Eight times that: a ray starts
/// up to a box's width before the box, its direction is rounded over twice that length, and Embree's box tests round
/// too (its robust mode does not cover user geometry).
template <class Geometry>
void group_bounds(const User<Geometry>& user, std::uint32_t group, RTCBounds& written) {
  constexpr double pad = 0x1p-21;
  Bounds bounds;
  user.groups.for_each(group, [&](std::uint32_t primitive) { include_primitive(bounds, *user.geometry, primitive); });
  written.lower_x = static_cast<float>(bounds.low.x - pad);
  written.lower_y = static_cast<float>(bounds.low.y - pad);
  written.lower_z = static_cast<float>(bounds.low.z - pad);
  written.upper_x = static_cast<float>(bounds.high.x + pad);
  written.upper_y = static_cast<float>(bounds.high.y + pad);
  written.upper_z = static_cast<float>(bounds.high.z + pad);
}

template <class Geometry>
void bounds_callback(const RTCBoundsFunctionArguments* args) {
  acquire(args->geometryUserPtr);
  group_bounds(*static_cast<const User<Geometry>*>(args->geometryUserPtr), args->primID, *args->bounds_o);
  release(args->geometryUserPtr);
}

/// Calls visit(range, valid, tfar) for the lanes that Embree passes to a callback: at once for a packet or half of it,
/// in which lanes keep their order, and else one by one.
template <class Visit>
void visit_lanes(RTCRayN* rays, unsigned count, const int* valid, const Visit& visit) {
  const auto id = [&](unsigned i) { return static_cast<int>(RTCRayN_id(rays, count, i)); };
  if (count == packet_size || count == half_packet) {
    visit(LaneRange{id(0), static_cast<int>(count)}, valid, &RTCRayN_tfar(rays, count, 0));
    return;
  }
  for (unsigned i = 0; i < count; ++i)
    if (valid[i] != 0) visit(LaneRange{id(i), 1}, valid + i, &RTCRayN_tfar(rays, count, i));
}

template <class Geometry>
void intersect_callback(const RTCIntersectFunctionNArguments* args) {
  const auto& user = *static_cast<const User<Geometry>*>(args->geometryUserPtr);
  RTCRayN* rays = RTCRayHitN_RayN(args->rayhit, args->N);
  TrianglePairBounds storage;
  visit_lanes(rays, args->N, args->valid, [&](LaneRange range, const int* valid, float* tfar) {
    intersect(Packet::of(args->context), range, valid, tfar, rays, *user.geometry,
              user.groups.at(args->primID, storage));
  });
}

template <class Geometry>
void occluded_callback(const RTCOccludedFunctionNArguments* args) {
  const auto& user = *static_cast<const User<Geometry>*>(args->geometryUserPtr);
  TrianglePairBounds storage;
  visit_lanes(args->ray, args->N, args->valid, [&](LaneRange range, const int* valid, float* tfar) {
    occluded(Packet::of(args->context), range, valid, tfar, args->ray, *user.geometry,
             user.groups.at(args->primID, storage));
  });
}

bool count_memory(void* total, ssize_t bytes, bool /*post*/) {
  static_cast<std::atomic<std::int64_t>*>(total)->fetch_add(bytes, std::memory_order_relaxed);
  return true;
}

/// Maximum number of primitives, or pairs of triangles, in a leaf of the tree: the box of a leaf is tested once for
/// all. The test of a frustum costs more than that of a box. Processor time of whole images at depth 5 on an AVX-512
/// core, relative to one primitive per leaf: with two, spheres 0.97 to 0.99, meshes 0.93 to 1.02, a lattice of
/// cylinders 1.06; with four, 0.96 to 1.06, and 1.09.
const char* device_settings(const GeometrySet& set) {
  return set.quadrics.empty() ? WHITTLE_EMBREE_ISA "object_accel_max_leaf_size=2"
                              : WHITTLE_EMBREE_ISA "object_accel_max_leaf_size=1";
}

/// True for less than half of the primitives: more would cost more memory than the time is worth.
bool transmissive_is_small_part(const GeometrySet& set) {
  std::size_t all = 0, transmissive = 0;
  const auto count = [&](const auto& geometries) {
    for (const auto& geometry : geometries) {
      all += geometry.size();
      transmissive += geometry.transmissive ? geometry.size() : 0;
    }
  };
  count(set.spheres);
  count(set.triangles);
  count(set.quadrics);
  return transmissive > 0 && 2 * transmissive < all;
}

/// See Accelerator::max_transmissive_hits().
std::uint64_t max_transmissive_hits(const GeometrySet& set) {
  constexpr std::uint64_t convex = StandardShape::max_hits;
  std::uint64_t hits = 0;
  for (const SphereGeometry& g : set.spheres) hits += g.transmissive ? convex * g.size() : 0;
  for (const TriangleGeometry& g : set.triangles) hits += g.transmissive ? convex * g.size() : 0;
  for (const QuadricGeometry& g : set.quadrics)
    for (std::size_t i = 0; g.transmissive && i < g.size(); ++i)
      visit_kind(g.quadrics[i].kind, [&](auto standard) { hits += standard.max_hits; });
  for (const std::uint8_t transmissive : set.planes.transmissive) hits += convex * transmissive;
  return 2 * hits;
}

bool keep_building(void* control, double /*fraction*/) { return !static_cast<RenderControl*>(control)->cancelled(); }

}  // namespace

struct Accelerator::Embree {
  struct Tree {
    RTCScene scene = nullptr;
    Bounds box;
    BoundingSphere sphere{{}, -std::numeric_limits<double>::infinity()};
    void include(const RTCBounds& bounds) {
      box.include(Vec3{bounds.lower_x, bounds.lower_y, bounds.lower_z});
      box.include(Vec3{bounds.upper_x, bounds.upper_y, bounds.upper_z});
    }
    void update_sphere() {
      if (box.empty()) return;
      const Vec3 center = (box.low + box.high) * 0.5;
      sphere = {center, length(box.high - box.low) * 0.5 + 0x1p-18, length(center)};
    }
  };

  RTCDevice device = nullptr;
  Tree all;
  /// Tree of transmissive geometry, for shadow rays that no opaque surface occludes: most of them hit none of it. The
  /// same as `all` unless transmissive geometry is a small part.
  Tree transmissive;
  std::vector<User<SphereGeometry>> spheres;
  std::vector<User<TriangleGeometry>> triangles;
  std::vector<User<QuadricGeometry>> quadrics;
  std::atomic<std::int64_t> bytes{0};

  explicit Embree(const GeometrySet& set) : device(rtcNewDevice(device_settings(set))) {
    if (device == nullptr) return;
    rtcSetDeviceMemoryMonitorFunction(device, count_memory, &bytes);
    all.scene = rtcNewScene(device);
    transmissive.scene = transmissive_is_small_part(set) ? rtcNewScene(device) : all.scene;
  }
  ~Embree() {
    if (own_transmissive()) rtcReleaseScene(transmissive.scene);
    if (all.scene != nullptr) rtcReleaseScene(all.scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }
  Embree(Embree&&) = delete;

  [[nodiscard]] bool own_transmissive() const { return transmissive.scene != all.scene; }
  [[nodiscard]] const Tree& tree_for(GeometryMask mask) const {
    return mask == GeometryMask::transmissive ? transmissive : all;
  }
  template <class Geometry>
  void add(std::vector<User<Geometry>>& users, const std::vector<Geometry>& geometries, std::uint32_t first,
           const RenderControl& control);
  void build(RenderControl& control);
  void for_each_user(void (*visit)(void*)) {
    for (auto& user : spheres) visit(&user);
    for (auto& user : triangles) visit(&user);
    for (auto& user : quadrics) visit(&user);
  }
};

template <class Geometry>
void Accelerator::Embree::add(std::vector<User<Geometry>>& users, const std::vector<Geometry>& geometries,
                              std::uint32_t first, const RenderControl& control) {
  users.reserve(geometries.size());  // Embree keeps pointers to these: they must not move
  for (const Geometry& added : geometries) {
    const auto index = first + static_cast<std::uint32_t>(users.size());
    User<Geometry>& user = users.emplace_back(User<Geometry>{&added, PrimitiveGroups<Geometry>(added, index, control)});
    const std::uint32_t count = user.groups.count();
    bytes.fetch_add(static_cast<std::int64_t>(user.groups.memory_bytes()), std::memory_order_relaxed);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, count);
    rtcSetGeometryUserData(geometry, &user);
    rtcSetGeometryBoundsFunction(geometry, bounds_callback<Geometry>, nullptr);
    rtcSetGeometryIntersectFunction(geometry, intersect_callback<Geometry>);
    rtcSetGeometryOccludedFunction(geometry, occluded_callback<Geometry>);
    rtcSetGeometryMask(geometry, bits_of(added.transmissive ? GeometryMask::transmissive : GeometryMask::opaque));
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(all.scene, geometry, index);
    if (added.transmissive && own_transmissive()) rtcAttachGeometryByID(transmissive.scene, geometry, index);
    rtcReleaseGeometry(geometry);
    for (std::uint32_t group = 0; group < count; ++group) {
      if (cancelled_at(group, control)) return;
      RTCBounds bounds;
      group_bounds(user, group, bounds);
      all.include(bounds);
      if (added.transmissive) transmissive.include(bounds);
    }
  }
  all.update_sphere();
  transmissive.update_sphere();
}

/// Commits the scenes. Errors are read from the device afterwards (rtcGetDeviceError). Always of Embree's medium build
/// quality: low quality builds in 0.7 to 0.94 of the time and traces in up to 1.1, from which no image is small enough
/// to gain; high quality splits no user geometry, and so is the same.
void Accelerator::Embree::build(RenderControl& control) {
  for (const Tree* tree : {&all, &transmissive}) {
    if (control.cancelled() || (tree == &transmissive && !own_transmissive())) continue;
    rtcSetSceneFlags(tree->scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneProgressMonitorFunction(tree->scene, keep_building, &control);
    for_each_user(release);
    rtcCommitScene(tree->scene);
    for_each_user(acquire);
    rtcSetSceneProgressMonitorFunction(tree->scene, nullptr, nullptr);
  }
}

Accelerator::Accelerator(GeometrySet geometry, std::unique_ptr<Embree> embree)
    : geometry_(std::move(geometry)),
      max_transmissive_hits_(tracer::max_transmissive_hits(geometry_)),
      embree_(std::move(embree)) {}
Accelerator::~Accelerator() = default;

Result<std::shared_ptr<const Accelerator>, Failure> Accelerator::build(GeometrySet geometry, RenderControl& control) {
  auto made_embree = std::make_unique<Embree>(geometry);
  const std::shared_ptr<const Accelerator> made(new Accelerator(std::move(geometry), std::move(made_embree)));
  const GeometrySet& set = made->geometry_;
  Embree& embree = *made->embree_;
  if (embree.all.scene == nullptr) return Failure{Failure::Code::internal, "Embree cannot start on this machine"};
  embree.add(embree.spheres, set.spheres, 0, control);
  embree.add(embree.triangles, set.triangles, set.first_triangles(), control);
  embree.add(embree.quadrics, set.quadrics, set.first_quadrics(), control);
  if (control.cancelled()) return Failure{Failure::Code::cancelled, "cancelled before building"};
  embree.build(control);
  const RTCError error = rtcGetDeviceError(embree.device);
  if (error == RTC_ERROR_CANCELLED || control.cancelled())
    return Failure{Failure::Code::cancelled, "cancelled while building"};
  if (error == RTC_ERROR_OUT_OF_MEMORY) return Failure{Failure::Code::out_of_memory, "no memory for the BVH"};
  if (error != RTC_ERROR_NONE) return Failure{Failure::Code::internal, "Embree could not build the BVH"};
  return made;
}

void Accelerator::intersect(const RaySpan& rays, const HitSpan& hits, Coherence coherence, GeometryMask mask) const {
  Packet packet;
  RTCRayHit16 rayhit;
  begin(packet, rays, coherence, bits_of(mask), rayhit.ray);
  std::fill_n(rayhit.hit.geomID, packet_size, RTC_INVALID_GEOMETRY_ID);
  const Embree::Tree& tree = embree_->tree_for(mask);
  for (std::size_t first = 0; first < rays.count; first += packet_size) {
    const int count = static_cast<int>(std::min<std::size_t>(packet_size, rays.count - first));
    load(packet, rays, first, count, tree.sphere);
    intersect_planes(packet, geometry_.planes, geometry_.plane_geometry(), mask);
    if (any_active(packet)) {
      if (!geometry_.triangles.empty()) load_for_triangles(packet, tree.sphere);
      write_rays(packet, rayhit.ray);
      rtcIntersect16(packet.active, tree.scene, &packet.context, &rayhit);
    }
    write_hits(packet, hits, first, count);
  }
}

void Accelerator::occluded(const RaySpan& rays, std::uint8_t* blocked, Coherence coherence) const {
  Packet packet;
  RTCRay16 ray;
  begin(packet, rays, coherence, bits_of(GeometryMask::opaque), ray);
  const Embree::Tree& tree = embree_->all;
  for (std::size_t first = 0; first < rays.count; first += packet_size) {
    const int count = static_cast<int>(std::min<std::size_t>(packet_size, rays.count - first));
    load(packet, rays, first, count, tree.sphere);
    occluded_by_planes(packet, geometry_.planes, geometry_.plane_geometry());
    if (!geometry_.triangles.empty()) load_for_triangles(packet, tree.sphere);
    write_rays(packet, ray);
    rtcOccluded16(packet.active, tree.scene, &packet.context, &ray);
    write_blocked(packet, ray, blocked + first, count);
  }
}

std::uint64_t Accelerator::memory_bytes() const {
  return static_cast<std::uint64_t>(embree_->bytes.load()) + tracer::memory_bytes(geometry_);
}

}  // namespace tracer
