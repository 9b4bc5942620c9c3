#include <atomic>
#include <optional>

#include "tracer/src/accel/packet.h"
#include "tracer/src/accel/partial_packet.h"
#include "tracer/src/accel/primitive_groups.h"
#include "tracer/src/shapes/registry.h"

#if defined(__SANITIZE_THREAD__)
#include <sanitizer/tsan_interface.h>
#endif

namespace tracer {
namespace {

/// Embree's threads build the tree between two hand-overs that ThreadSanitizer cannot see, since Embree's library is
/// not instrumented: from the thread that commits the scene, and back to it. These two tell it.
void hand_over([[maybe_unused]] void* what) {
#if defined(__SANITIZE_THREAD__)
  __tsan_release(what);
#endif
}
void take_over([[maybe_unused]] void* what) {
#if defined(__SANITIZE_THREAD__)
  __tsan_acquire(what);
#endif
}

constexpr unsigned mask_opaque = 1, mask_transmissive = 2, mask_all = 3;

unsigned mask_of(GeometryMask mask) {
  switch (mask) {
    case GeometryMask::opaque:
      return mask_opaque;
    case GeometryMask::transmissive:
      return mask_transmissive;
    case GeometryMask::all:
      break;
  }
  return mask_all;
}

/// What a callback needs to find its geometry.
template <class Geometry>
struct User {
  const Geometry* geometry;
  std::uint32_t index;
  PrimitiveGroups<Geometry> runs;
};

/// Box in float that surely holds [low, high] as Embree's float rays see it. They are wrong by some 2^-24 of the
/// scene's box (about one) wherever they are, so the pad is absolute: relative to a primitive near 0 it would be
/// nothing. Eight times that: a ray starts up to a box's width before the box, its direction is rounded over two of
/// these, and Embree's own box tests round too (its robust mode does not reach user geometry).
void write_bounds(const Vec3& low, const Vec3& high, RTCBounds& bounds) {
  constexpr double pad = 0x1p-21;
  bounds.lower_x = static_cast<float>(low.x - pad);
  bounds.lower_y = static_cast<float>(low.y - pad);
  bounds.lower_z = static_cast<float>(low.z - pad);
  bounds.upper_x = static_cast<float>(high.x + pad);
  bounds.upper_y = static_cast<float>(high.y + pad);
  bounds.upper_z = static_cast<float>(high.z + pad);
}

void include_primitive(Bounds& bounds, const SphereGeometry& g, std::uint32_t i) {
  const Vec3 center{g.x[i], g.y[i], g.z[i]}, r{g.radius[i], g.radius[i], g.radius[i]};
  bounds.include(center, r);
}

void include_primitive(Bounds& bounds, const TriangleGeometry& geometry, std::uint32_t primitive) {
  for (const std::uint32_t vertex : geometry.triangles[primitive]) bounds.include(geometry.position(vertex));
}

void include_primitive(Bounds& bounds, const QuadricGeometry& geometry, std::uint32_t primitive) {
  const Quadric& q = geometry.quadrics[primitive];
  visit_kind(q.kind, [&](auto standard) { standard.include(bounds, q); });
}

template <class Geometry>
void run_bounds(const User<Geometry>& user, std::uint32_t run, RTCBounds& written) {
  Bounds bounds;
  user.runs.for_each(run, [&](std::uint32_t primitive) { include_primitive(bounds, *user.geometry, primitive); });
  write_bounds(bounds.low, bounds.high, written);
}

template <class Geometry>
void bounds_callback(const RTCBoundsFunctionArguments* args) {
  take_over(args->geometryUserPtr);
  run_bounds(*static_cast<const User<Geometry>*>(args->geometryUserPtr), args->primID, *args->bounds_o);
  hand_over(args->geometryUserPtr);
}

/// Nothing when Embree asks about less than half of the packet. Lanes keep their order in a half.
std::optional<Asked> asked_about(RTCRayN* rays, unsigned count) {
  if (count == packet_size) return Asked::whole;
  if (count != half_packet) return std::nullopt;
  return RTCRayN_id(rays, count, 0) == 0 ? Asked::first_half : Asked::second_half;
}

/// What is one to Embree, against whole packets or halves of them.
template <class Geometry>
void closest_of(const User<Geometry>& user, Packet& packet, Asked asked, const int* valid, RTCRayN* rays,
                std::uint32_t run) {
  const unsigned count = asked == Asked::whole ? packet_size : half_packet;
  intersect(packet, asked, valid, &RTCRayN_tfar(rays, count, 0), *user.geometry, PrimitiveRef{user.index, run});
}
void closest_of(const User<TriangleGeometry>& user, Packet& packet, Asked asked, const int* valid, RTCRayN* rays,
                std::uint32_t run) {
  TrianglePairBounds room;
  intersect(packet, asked, valid, rays, *user.geometry, user.runs.in_floats(run, room));
}
template <class Geometry>
void occluded_of(const User<Geometry>& user, const Packet& packet, Asked asked, const int* valid, RTCRayN* rays,
                 std::uint32_t run) {
  const unsigned count = asked == Asked::whole ? packet_size : half_packet;
  occluded(packet, asked, valid, &RTCRayN_tfar(rays, count, 0), *user.geometry, PrimitiveRef{user.index, run});
}
void occluded_of(const User<TriangleGeometry>& user, const Packet& packet, Asked asked, const int* valid, RTCRayN* rays,
                 std::uint32_t run) {
  TrianglePairBounds room;
  occluded(packet, asked, valid, rays, *user.geometry, user.runs.in_floats(run, room));
}

template <class Geometry>
void intersect_callback(const RTCIntersectFunctionNArguments* args) {
  const auto& user = *static_cast<const User<Geometry>*>(args->geometryUserPtr);
  Packet& packet = Packet::of(args->context);
  RTCRayN* rays = RTCRayHitN_RayN(args->rayhit, args->N);
  if (const std::optional<Asked> asked = asked_about(rays, args->N)) {
    closest_of(user, packet, *asked, args->valid, rays, args->primID);
    return;
  }
  user.runs.for_each(args->primID, [&](std::uint32_t primitive) {
    for (unsigned i = 0; i < args->N; ++i)
      if (args->valid[i] != 0)
        closest_lane(packet, RTCRayN_id(rays, args->N, i), RTCRayN_tfar(rays, args->N, i), *user.geometry,
                     {user.index, primitive});
  });
}

template <class Geometry>
void occluded_callback(const RTCOccludedFunctionNArguments* args) {
  const auto& user = *static_cast<const User<Geometry>*>(args->geometryUserPtr);
  const Packet& packet = Packet::of(args->context);
  if (const std::optional<Asked> asked = asked_about(args->ray, args->N)) {
    occluded_of(user, packet, *asked, args->valid, args->ray, args->primID);
    return;
  }
  user.runs.for_each(args->primID, [&](std::uint32_t primitive) {
    for (unsigned i = 0; i < args->N; ++i)
      if (args->valid[i] != 0)
        occluded_lane(packet, RTCRayN_id(args->ray, args->N, i), RTCRayN_tfar(args->ray, args->N, i), *user.geometry,
                      {user.index, primitive});
  });
}

bool count_memory(void* total, ssize_t bytes, bool /*post*/) {
  static_cast<std::atomic<std::int64_t>*>(total)->fetch_add(bytes, std::memory_order_relaxed);
  return true;
}

/// How many primitives, or pairs of triangles, lie in one leaf of the tree at most: a leaf's box is tested once for all
/// of them. A frustum's test costs more than a box of its own. Whole images at depth 5, an AVX-512 core, processor
/// time with two to one: spheres 0.97 to 0.99, meshes 0.93 to 1.02, a lattice of cylinders 1.06; with four: 0.96 to
/// 1.06, and 1.09.
const char* device_settings(const GeometrySet& set) {
  return set.quadrics.empty() ? "object_accel_max_leaf_size=2" : "object_accel_max_leaf_size=1";
}

std::size_t size(const SphereGeometry& spheres) { return spheres.x.size(); }
std::size_t size(const TriangleGeometry& mesh) { return mesh.triangles.size(); }
std::size_t size(const QuadricGeometry& quadrics) { return quadrics.quadrics.size(); }

/// Less than half of the primitives: more would cost more memory than the time is worth.
bool transmissive_is_small_part(const GeometrySet& set) {
  std::size_t all = 0, transmissive = 0;
  const auto count = [&](const auto& geometries) {
    for (const auto& geometry : geometries) {
      all += size(geometry);
      transmissive += geometry.transmissive ? size(geometry) : 0;
    }
  };
  count(set.spheres);
  count(set.triangles);
  count(set.quadrics);
  return transmissive > 0 && 2 * transmissive < all;
}

bool keep_building(void* control, double /*fraction*/) { return !static_cast<RenderControl*>(control)->cancelled(); }

}  // namespace

struct Accelerator::Embree {
  struct Tree {
    RTCScene scene = nullptr;
    Bounds box;
    BoundingSphere ball{{}, -std::numeric_limits<double>::infinity()};
    void close_ball() {
      if (box.empty()) return;
      const Vec3 center = (box.low + box.high) * 0.5;
      ball = {center, length(box.high - box.low) * 0.5 + 0x1p-18, length(center)};
    }
  };

  RTCDevice device = nullptr;
  Tree all;
  /// What lets light through: shadow rays that nothing opaque stops ask for it alone, and most meet none of it. A tree
  /// of its own where it is a small part, else that of all.
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
  Embree(const Embree&) = delete;
  Embree& operator=(const Embree&) = delete;

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
  users.reserve(geometries.size());  // pointers to these are handed to Embree: they must not move
  for (const Geometry& added : geometries) {
    const auto index = first + static_cast<std::uint32_t>(users.size());
    User<Geometry>& user = users.emplace_back(User<Geometry>{&added, index, PrimitiveGroups<Geometry>(added, index)});
    const std::uint32_t count = user.runs.count();
    bytes.fetch_add(static_cast<std::int64_t>(user.runs.memory_bytes()), std::memory_order_relaxed);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, count);
    rtcSetGeometryUserData(geometry, &user);
    rtcSetGeometryBoundsFunction(geometry, bounds_callback<Geometry>, nullptr);
    rtcSetGeometryIntersectFunction(geometry, intersect_callback<Geometry>);
    rtcSetGeometryOccludedFunction(geometry, occluded_callback<Geometry>);
    rtcSetGeometryMask(geometry, added.transmissive ? mask_transmissive : mask_opaque);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(all.scene, geometry, user.index);
    if (added.transmissive && own_transmissive()) rtcAttachGeometryByID(transmissive.scene, geometry, user.index);
    rtcReleaseGeometry(geometry);
    for (std::uint32_t run = 0; run < count; ++run) {
      constexpr std::uint32_t at_once = 1u << 16;  // about a millisecond
      if (run % at_once == 0 && control.cancelled()) return;
      RTCBounds bounds;
      run_bounds(user, run, bounds);
      all.box.include({bounds.lower_x, bounds.lower_y, bounds.lower_z});
      all.box.include({bounds.upper_x, bounds.upper_y, bounds.upper_z});
      if (!added.transmissive) continue;
      transmissive.box.include({bounds.lower_x, bounds.lower_y, bounds.lower_z});
      transmissive.box.include({bounds.upper_x, bounds.upper_y, bounds.upper_z});
    }
  }
  all.close_ball();
  transmissive.close_ball();
}

/// Commits the trees. What went wrong the device knows. Always of Embree's medium quality, whatever number of rays is
/// expected: its low one builds in 0.7 to 0.94 of the time and traces in up to 1.1, which no image is small enough to
/// gain by; its high one splits no user geometry, and so is the same.
void Accelerator::Embree::build(RenderControl& control) {
  for (const Tree* tree : {&all, &transmissive}) {
    if (control.cancelled() || (tree == &transmissive && !own_transmissive())) continue;
    rtcSetSceneFlags(tree->scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneProgressMonitorFunction(tree->scene, keep_building, &control);
    for_each_user(hand_over);
    rtcCommitScene(tree->scene);
    for_each_user(take_over);
    rtcSetSceneProgressMonitorFunction(tree->scene, nullptr, nullptr);
  }
}

Accelerator::Accelerator(GeometrySet geometry, std::unique_ptr<Embree> embree)
    : geometry_(std::move(geometry)), embree_(std::move(embree)) {}
Accelerator::~Accelerator() = default;

Result<std::shared_ptr<const Accelerator>, Failure> Accelerator::build(GeometrySet geometry, RenderControl& control) {
  auto embree_for_it = std::make_unique<Embree>(geometry);
  const std::shared_ptr<const Accelerator> made(new Accelerator(std::move(geometry), std::move(embree_for_it)));
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
  begin(packet, rays, coherence, mask_of(mask), rayhit.ray);
  std::fill_n(rayhit.hit.geomID, packet_size, RTC_INVALID_GEOMETRY_ID);
  const Embree::Tree& tree = embree_->tree_for(mask);
  const auto trace = [&](const RaySpan& span, const HitSpan& answers, std::size_t first) {
    load(packet, span, first, tree.ball);
    closest_planes(packet, geometry_.planes, geometry_.plane_geometry(), mask);
    if (any_active(packet)) {
      if (!geometry_.triangles.empty()) load_for_triangles(packet, tree.ball);
      write_rays(packet, rayhit.ray);
      rtcIntersect16(packet.active, tree.scene, &packet.context, &rayhit);
    }
    write_hits(packet, answers, first);
  };
  std::size_t first = 0;
  for (; first + packet_size <= rays.count; first += packet_size) trace(rays, hits, first);
  if (first == rays.count) return;
  PartialPacket last(rays, first);
  trace(last.rays(), last.hits(), 0);
  last.write(hits, first);
}

void Accelerator::occluded(const RaySpan& rays, std::uint8_t* blocked, Coherence coherence) const {
  Packet packet;
  RTCRay16 ray;
  begin(packet, rays, coherence, mask_opaque, ray);
  const auto trace = [&](const RaySpan& span, std::uint8_t* answers, std::size_t first) {
    load(packet, span, first, embree_->all.ball);
    occluded_planes(packet, geometry_.planes, geometry_.plane_geometry());
    if (!geometry_.triangles.empty()) load_for_triangles(packet, embree_->all.ball);
    write_rays(packet, ray);
    rtcOccluded16(packet.active, embree_->all.scene, &packet.context, &ray);
    write_blocked(packet, ray, answers + first);
  };
  std::size_t first = 0;
  for (; first + packet_size <= rays.count; first += packet_size) trace(rays, blocked, first);
  if (first == rays.count) return;
  PartialPacket last(rays, first);
  std::uint8_t answers[packet_size];
  trace(last.rays(), answers, 0);
  std::copy_n(answers, rays.count - first, blocked + first);
}

std::uint64_t Accelerator::memory_bytes() const {
  return static_cast<std::uint64_t>(embree_->bytes.load()) + tracer::memory_bytes(geometry_);
}

}  // namespace tracer
