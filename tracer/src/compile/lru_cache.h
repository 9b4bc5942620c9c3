#pragma once
/// Things by name, made once by whoever comes first, kept within a budget of bytes.

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
  struct Name {
    Kind kind = Kind::geometry;
    std::string content;
    auto operator<=>(const Name&) const = default;  // NOLINT(modernize-use-nullptr): of what the compiler writes
  };
  /// What it is goes by its name's kind.
  using Thing = std::shared_ptr<const void>;

  explicit LruCache(std::uint64_t bytes_max) : bytes_max_(bytes_max) {}

  /// Of several with the same name at once the first has it to make. The others wait until it is kept, or until the
  /// first one's turn has gone: then it is the next one's.
  class Turn {
   public:
    Turn(Turn&& other) noexcept = default;
    Turn& operator=(Turn&&) = delete;
    ~Turn();
    [[nodiscard]] const Thing& found() const { return found_; }  ///< null: it is the caller's to make
    /// Precondition: nothing was found, and nothing kept yet. Keeps what is no more than may be kept at all, in place
    /// of what was not used for longest.
    void keep(Thing thing, std::uint64_t bytes);

   private:
    friend class LruCache;
    Turn(std::shared_ptr<LruCache> shelf, Name name, Thing found)
        : shelf_(std::move(shelf)), name_(std::move(name)), found_(std::move(found)) {}

    std::shared_ptr<LruCache> shelf_;  ///< null once moved from or kept
    Name name_;
    Thing found_;
  };
  /// Fails with `cancelled`, while it waits.
  Result<Turn, Failure> turn(const Name& name, const RenderControl& control);

  void clear();
  [[nodiscard]] std::uint64_t memory_bytes(Kind kind) const;
  [[nodiscard]] std::uint64_t bytes_max() const { return bytes_max_; }

 private:
  struct Entry {
    Thing thing;  ///< null while it is being made
    std::uint64_t bytes = 0;
    std::uint64_t used = 0;  ///< the higher, the later
  };
  void release_ticket(const Name& name, Thing thing, std::uint64_t bytes);
  void evict_oldest();

  const std::uint64_t bytes_max_;
  mutable std::mutex mutex_;
  std::condition_variable turn_ended_;
  std::map<Name, Entry> entries_;
  std::uint64_t bytes_ = 0, uses_ = 0;
};

}  // namespace tracer
