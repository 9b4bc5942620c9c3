#pragma once
/// Shapes and their BVHs, kept for the next scene that has the same: the frames of a camera sweep build theirs once.
///
///   tracer::GeometryCache cache(512u << 20);                            // bytes
///   auto first = tracer::compile(scene, control, assets, &cache);       // builds
///   scene.camera.position.x += 1;
///   auto second = tracer::compile(scene, control, assets, &cache);      // tracer::reused_geometry(**second)
///
/// What is kept is known by what rays meet, after transforms, instances and the frame they are traced in: every bit of
/// it is compared, so nothing that a scene says can make it meet another one's shapes, and its picture is bit for bit
/// what it is without a cache. So scenes share it that differ in camera, image, lights, background, accuracy, output,
/// or materials, as long as none becomes transmissive or ceases to be (opaque and transmissive surfaces are kept
/// apart). Only a scene of nothing but planes is traced in a frame that follows its camera, and such have no BVH.
///
/// Placing the shapes and comparing them is done for every scene, a tenth of the work.

#include <cstdint>
#include <memory>

#include "tracer/compile.h"
#include "tracer/control.h"
#include "tracer/result.h"

namespace tracer {

class Accelerator;
struct GeometrySet;

/// Thread-safe. Compiled scenes may outlive it: they hold their geometry themselves.
class GeometryCache {
 public:
  /// Geometry with less, its BVH not counted, is not kept: that is built in less than a millisecond.
  static constexpr std::uint64_t worthwhile_bytes = 64u << 10;

  /// Keeps at most `bytes_max`, those used last. What compiled scenes still hold counts no more once it had to go.
  explicit GeometryCache(std::uint64_t bytes_max);
  ~GeometryCache();
  GeometryCache(const GeometryCache&) = delete;
  GeometryCache& operator=(const GeometryCache&) = delete;

  /// Keeps nothing of what there is; what is being built will be kept.
  void clear();
  [[nodiscard]] std::uint64_t memory_bytes() const;  ///< of all that is kept

  struct Found {
    std::shared_ptr<const Accelerator> accelerator;
    bool reused = false;  ///< another one built it
  };
  /// Used by `compile`. Of several callers at once with the same geometry one builds it and the others wait for it;
  /// when that one is cancelled or fails, the next of them builds. A caller that waits answers its own `control` within
  /// 10 ms. Fails as Accelerator::build does; throws std::bad_alloc.
  Result<Found, Failure> find_or_build(GeometrySet geometry, RenderControl& control);

 private:
  struct Entries;
  std::unique_ptr<Entries> entries_;
};

}  // namespace tracer
