#pragma once
/// Access of one compilation to a SceneCache, and the storage of that cache.

#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tracer/compile.h"
#include "tracer/control.h"
#include "tracer/result.h"
#include "tracer/scene.h"
#include "tracer/src/accel/accelerator.h"
#include "tracer/src/radiosity/patches.h"
#include "tracer/src/scene/render_space.h"
#include "tracer/src/textures/image_map.h"

namespace tracer {

/// LRU cache with a byte budget; concurrent requests for one key build its value once. Thread-safe.
class LruCache : public std::enable_shared_from_this<LruCache> {
 public:
  enum class Kind { geometry, image, radiosity };
  struct Key {
    Kind kind = Kind::geometry;
    std::string content;
    auto operator<=>(const Key&) const = default;  // NOLINT(modernize-use-nullptr): of what the compiler writes
  };
  /// The key's kind determines the type.
  using Value = std::shared_ptr<const void>;

  explicit LruCache(std::uint64_t bytes_max) : bytes_max_(bytes_max) {}

  /// Result of acquire(): the cached value, or the exclusive permission to build it. Other callers wait until the value
  /// is stored, or until the ticket is destroyed: then the next of them builds.
  class BuildTicket {
   public:
    BuildTicket(BuildTicket&& other) noexcept = default;
    ~BuildTicket();
    [[nodiscard]] const Value& found() const { return found_; }  ///< null: the caller builds the value
    /// Precondition: nothing was found or stored before. Evicts least recently used values as needed; a value larger
    /// than the whole budget is not stored.
    void store(Value value, std::uint64_t bytes);

   private:
    friend class LruCache;
    BuildTicket(std::shared_ptr<LruCache> cache, Key key, Value found)
        : cache_(std::move(cache)), key_(std::move(key)), found_(std::move(found)) {}

    std::shared_ptr<LruCache> cache_;  ///< null once moved from or stored
    Key key_;
    Value found_;
  };
  /// Fails with `cancelled` while it waits.
  Result<BuildTicket, Failure> acquire(const Key& key, const RenderControl& control);

  void clear();
  [[nodiscard]] std::uint64_t memory_bytes(Kind kind) const;
  [[nodiscard]] std::uint64_t bytes_max() const { return bytes_max_; }

 private:
  struct Entry {
    Value value;  ///< null while under construction
    std::uint64_t bytes = 0;
    std::uint64_t used = 0;  ///< number of the last use
  };
  void release_ticket(const Key& key, Value value, std::uint64_t bytes);
  void evict_oldest();

  const std::uint64_t bytes_max_;
  mutable std::mutex mutex_;
  std::condition_variable released_;
  std::map<Key, Entry> entries_;
  std::uint64_t bytes_ = 0, uses_ = 0;
};

/// Accelerator and world-space bounds of cached geometry.
struct CachedGeometry {
  std::shared_ptr<const Accelerator> accelerator;
  FiniteBounds bounds;
};

/// Used only by the thread that compiles the scene.
class SceneCacheEntry {
 public:
  /// `geometry`: empty if the scene's geometry is not cached. `radiosity_key`: empty if its patches are not.
  SceneCacheEntry(std::shared_ptr<LruCache> cache, std::vector<std::string> contents,
                  std::optional<LruCache::BuildTicket> geometry, std::string radiosity_key)
      : cache_(std::move(cache)),
        contents_(std::move(contents)),
        radiosity_key_(std::move(radiosity_key)),
        geometry_(std::move(geometry)) {}

  /// Geometry of an earlier scene, or null.
  [[nodiscard]] const CachedGeometry* geometry() const;
  /// Stores geometry of at least SceneCache::worthwhile_bytes. Precondition: geometry() is null.
  void store(const CachedGeometry& geometry);

  /// Empty if the content of the file is unknown. Fails with `cancelled`.
  Result<std::optional<LruCache::BuildTicket>, Failure> image(const ImageTexture& texture,
                                                              const RenderControl& control);
  /// Ticket whose value is a Radiosity, `stage` of its refinement. Empty if patches are not cached. Fails with
  /// `cancelled`.
  Result<std::optional<LruCache::BuildTicket>, Failure> radiosity(const std::string& stage,
                                                                  const RenderControl& control);
  /// Stores images of at least SceneCache::worthwhile_bytes.
  static void store(LruCache::BuildTicket ticket, const std::shared_ptr<const ImageMap>& image);

 private:
  std::shared_ptr<LruCache> cache_;
  std::vector<std::string> contents_;
  std::string radiosity_key_;
  std::optional<LruCache::BuildTicket> geometry_;
};

}  // namespace tracer
