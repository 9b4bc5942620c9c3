#pragma once
/// What scenes leave for the next ones: shapes with their BVH, and decoded images. The frames of a camera sweep read
/// their meshes, build and decode once.
///
///   tracer::SceneCache cache(512u << 20);                                // bytes
///   auto claim = cache.claim(scene, contents, control);                  // before the files of meshes are read
///   ... read the files that `scene` still names ...
///   auto compiled = tracer::compile(scene, control, assets, claim->get());
///
/// Geometry is known by everything that it is made from: the shapes, transforms, prototypes and instances of the scene
/// and the contents of its mesh files, each bit of them, as a digest that nobody can find a second scene for
/// (src/cache/digest.h). So scenes share it that differ in camera, image, lights, background, accuracy, output, or
/// materials, as long as none becomes transmissive or ceases to be (opaque and transmissive surfaces are kept apart),
/// and their images are bit for bit what they are without a cache. Images are known by the content of their file
/// and the colour space that it is read in, and kept with their mip maps.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tracer/compile.h"
#include "tracer/control.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

class LruCache;

/// Thread-safe. Claims and compiled scenes may outlive it: they hold what they have of it themselves.
class SceneCache {
 public:
  /// Geometry with less, its BVH not counted, and images with less are not kept: they are made in about a
  /// millisecond.
  static constexpr std::uint64_t worthwhile_bytes = 64u << 10;

  /// Keeps at most `bytes_max`, geometry and images together, those used last. What compiled scenes still hold counts
  /// no more once it had to go. 0: nothing is kept or shared.
  explicit SceneCache(std::uint64_t bytes_max);
  ~SceneCache();
  SceneCache(const SceneCache&) = delete;
  SceneCache& operator=(const SceneCache&) = delete;

  /// Keeps nothing of what there is; what is being made will be kept.
  void clear();

  struct Bytes {
    std::uint64_t geometry = 0, images = 0;
    [[nodiscard]] std::uint64_t all() const { return geometry + images; }
  };
  [[nodiscard]] Bytes memory_bytes() const;  ///< of all that is kept

  /// What there is for `scene`, for its `compile`. Where its geometry is there, the meshes of files need not be read
  /// and name none any more: `scene` is for `compile` then. Otherwise this caller is who builds it: of several at once
  /// with the same geometry one gets the turn and the others wait for it, until its claim has gone; where it was
  /// cancelled or failed, the next of them builds. A caller that waits answers its own `control` within 10 ms, with
  /// `cancelled`.
  /// `contents` are names for what is in the files of `scene.assets`, beside them: equal only where the bytes are.
  /// Empty, or missing at the end: not known, so that nothing is kept of it. Throws std::bad_alloc.
  Result<std::shared_ptr<SceneCacheEntry>, Failure> claim(Scene& scene, std::vector<std::string> contents,
                                                          const RenderControl& control);

 private:
  std::shared_ptr<LruCache> shelf_;
};

}  // namespace tracer
