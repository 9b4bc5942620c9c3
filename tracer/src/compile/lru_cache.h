#pragma once
/// LRU cache with a byte budget; concurrent requests for one key build its value once.

#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "tracer/compile.h"
#include "tracer/control.h"
#include "tracer/result.h"

namespace tracer {

/// Thread-safe.
class LruCache : public std::enable_shared_from_this<LruCache> {
 public:
  enum class Kind { geometry, image };
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
    BuildTicket& operator=(BuildTicket&&) = delete;
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

}  // namespace tracer
