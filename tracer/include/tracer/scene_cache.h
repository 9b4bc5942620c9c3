#pragma once
/// Cache of geometry (shapes with their BVH), decoded texture images and the light of patches. The frames of a camera
/// sweep read their meshes, build the BVH, decode and solve once.
///
///   tracer::SceneCache cache(512u << 20);                                // bytes
///   auto entry = cache.acquire(scene, contents, control);                // before mesh files are read
///   ... read the files that `scene` still names ...
///   auto compiled = tracer::compile(scene, control, assets, entry->get());
///
/// The key of geometry is the SHA-256 of everything it is made from: shapes, transforms, prototypes and instances of
/// the scene and the contents of its mesh files. Scenes that differ in camera, image, lights, background, accuracy,
/// output or materials share it, as long as the same materials are transmissive (opaque and transmissive surfaces are
/// stored apart). Geometry of a scene with materials for parts of mesh files is not stored. Images are bit-identical
/// with and without a cache. The key of a texture image is the content of its file and the color space; it is stored
/// with its mip maps. The light of patches (Approximations::Interreflection) is stored under a key of the caller.

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

/// Thread-safe. Entries and compiled scenes share ownership of their parts and may outlive it.
class SceneCache {
 public:
  /// Smaller geometry (without its BVH) and smaller images are not stored: they are rebuilt in about a millisecond.
  static constexpr std::uint64_t worthwhile_bytes = 64u << 10;

  /// Stores at most `bytes_max` of geometry and images together, least recently used evicted first. Evicted parts that
  /// compiled scenes still hold are not counted. 0: nothing is stored or shared.
  explicit SceneCache(std::uint64_t bytes_max);
  ~SceneCache();
  SceneCache(SceneCache&&) = delete;

  /// Evicts everything; parts under construction are stored later.
  void clear();

  struct Bytes {
    std::uint64_t geometry = 0, images = 0, radiosity = 0;
    [[nodiscard]] std::uint64_t all() const { return geometry + images + radiosity; }
  };
  [[nodiscard]] Bytes memory_bytes() const;

  /// Cache entry for compiling `scene`. If its geometry is cached, the meshes in `scene` no longer name their files,
  /// which need not be read. Otherwise the caller builds it: of several concurrent callers with equal geometry one
  /// builds, the others wait until its entry is destroyed; if it failed or was cancelled, the next one builds. A
  /// waiting caller returns `cancelled` within 10 ms of `control.cancel()`. `contents[i]` identifies the content of
  /// `scene.assets[i]`: equal only for equal bytes. Empty or missing: unknown, and nothing made from that file is
  /// stored. `everything_but_the_view`: equal only for scenes that differ in nothing but their camera, image size and
  /// output; empty: unknown, and patches are solved again. Throws std::bad_alloc.
  Result<std::shared_ptr<SceneCacheEntry>, Failure> acquire(Scene& scene, std::vector<std::string> contents,
                                                            const RenderControl& control,
                                                            const std::string& everything_but_the_view = {});

 private:
  std::shared_ptr<LruCache> cache_;
};

}  // namespace tracer
