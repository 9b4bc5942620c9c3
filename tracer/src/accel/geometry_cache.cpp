#include "tracer/geometry_cache.h"

#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <utility>

#include "tracer/src/accel/accelerator.h"

namespace tracer {
namespace {

Result<GeometryCache::Found, Failure> build(GeometrySet geometry, RenderControl& control) {
  auto built = Accelerator::build(std::move(geometry), control);
  if (!built) return built.error();
  return GeometryCache::Found{std::move(*built), false};
}

}  // namespace

struct GeometryCache::Entries {
  struct Entry {
    std::shared_ptr<const Accelerator> accelerator;  ///< null while it is being built
    std::uint64_t used = 0;                          ///< the higher, the later
  };
  using Shared = std::shared_ptr<const Accelerator>;

  explicit Entries(std::uint64_t most) : bytes_max(most) {}

  Result<Shared, Failure> wait_for(std::size_t hash, const RenderControl& control);
  void end_build(std::size_t hash, const Shared& accelerator);
  void drop_oldest();

  const std::uint64_t bytes_max;
  std::mutex mutex;
  std::condition_variable build_ended;
  std::map<std::size_t, Entry> by_hash;
  std::uint64_t bytes = 0, uses = 0;
};

/// Null: nothing is kept under the hash, and the caller is now who builds it, until end_build.
Result<GeometryCache::Entries::Shared, Failure> GeometryCache::Entries::wait_for(std::size_t hash,
                                                                                 const RenderControl& control) {
  constexpr std::chrono::milliseconds patience{10};  // a control does not call
  std::unique_lock lock(mutex);
  for (;;) {
    const auto [entry, is_new] = by_hash.try_emplace(hash);
    if (is_new) return Shared();
    if (entry->second.accelerator) {
      entry->second.used = ++uses;
      return entry->second.accelerator;
    }
    if (control.cancelled()) return Failure{Failure::Code::cancelled, "cancelled while another job built"};
    build_ended.wait_for(lock, patience);
  }
}

/// Those who wait look again. Null, or more than may be kept at all: the next of them builds.
void GeometryCache::Entries::end_build(std::size_t hash, const Shared& accelerator) {
  const std::lock_guard lock(mutex);
  const std::uint64_t more = accelerator ? accelerator->memory_bytes() : 0;
  if (accelerator && more <= bytes_max) {
    while (bytes > bytes_max - more) drop_oldest();
    by_hash[hash] = {accelerator, ++uses};
    bytes += more;
  } else {
    by_hash.erase(hash);
  }
  build_ended.notify_all();
}

/// Precondition: there is one, for something takes bytes.
void GeometryCache::Entries::drop_oldest() {
  auto oldest = by_hash.end();
  for (auto entry = by_hash.begin(); entry != by_hash.end(); ++entry)
    if (entry->second.accelerator && (oldest == by_hash.end() || entry->second.used < oldest->second.used))
      oldest = entry;
  bytes -= oldest->second.accelerator->memory_bytes();
  by_hash.erase(oldest);
}

GeometryCache::GeometryCache(std::uint64_t bytes_max) : entries_(std::make_unique<Entries>(bytes_max)) {}
GeometryCache::~GeometryCache() = default;

void GeometryCache::clear() {
  const std::lock_guard lock(entries_->mutex);
  while (entries_->bytes > 0) entries_->drop_oldest();
}

std::uint64_t GeometryCache::memory_bytes() const {
  const std::lock_guard lock(entries_->mutex);
  return entries_->bytes;
}

Result<GeometryCache::Found, Failure> GeometryCache::find_or_build(GeometrySet geometry, RenderControl& control) {
  if (tracer::memory_bytes(geometry) < worthwhile_bytes) return build(std::move(geometry), control);
  const std::size_t hash = hash_of(geometry);
  auto kept = entries_->wait_for(hash, control);
  if (!kept) return kept.error();
  if (*kept && same_bits((*kept)->geometry(), geometry)) return Found{std::move(*kept), true};
  if (*kept) return build(std::move(geometry), control);  // another one of the same hash: that stays

  struct Turn {
    ~Turn() { entries.end_build(hash, accelerator); }
    Entries& entries;
    std::size_t hash;
    Entries::Shared accelerator;
  };
  Turn turn{*entries_, hash, nullptr};
  auto built = build(std::move(geometry), control);
  if (built) turn.accelerator = built->accelerator;
  return built;
}

}  // namespace tracer
