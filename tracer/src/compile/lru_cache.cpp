#include "tracer/src/compile/lru_cache.h"

#include <chrono>
#include <utility>

namespace tracer {

LruCache::Turn::~Turn() {
  if (shelf_ && !found_) shelf_->release_ticket(name_, nullptr, 0);
}

void LruCache::Turn::keep(Thing thing, std::uint64_t bytes) {
  const std::shared_ptr<LruCache> shelf = std::move(shelf_);
  shelf->release_ticket(name_, std::move(thing), bytes);
}

Result<LruCache::Turn, Failure> LruCache::turn(const Name& name, const RenderControl& control) {
  constexpr std::chrono::milliseconds patience{10};  // a control does not call
  std::unique_lock lock(mutex_);
  for (;;) {
    const auto [entry, is_new] = entries_.try_emplace(name);
    if (is_new) return Turn(shared_from_this(), name, nullptr);
    if (entry->second.thing) {
      entry->second.used = ++uses_;
      return Turn(shared_from_this(), name, entry->second.thing);
    }
    if (control.cancelled()) return Failure{Failure::Code::cancelled, "cancelled while another one made the same"};
    turn_ended_.wait_for(lock, patience);
  }
}

/// Those who wait look again. Null, or more than may be kept at all: the next of them makes it.
void LruCache::release_ticket(const Name& name, Thing thing, std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  if (thing && bytes <= bytes_max_) {
    while (bytes_ > bytes_max_ - bytes) evict_oldest();
    entries_[name] = {std::move(thing), bytes, ++uses_};
    bytes_ += bytes;
  } else {
    entries_.erase(name);
  }
  turn_ended_.notify_all();
}

/// Precondition: there is one, for something takes bytes.
void LruCache::evict_oldest() {
  auto oldest = entries_.end();
  for (auto entry = entries_.begin(); entry != entries_.end(); ++entry)
    if (entry->second.thing && (oldest == entries_.end() || entry->second.used < oldest->second.used)) oldest = entry;
  bytes_ -= oldest->second.bytes;
  entries_.erase(oldest);
}

void LruCache::clear() {
  const std::lock_guard lock(mutex_);
  while (bytes_ > 0) evict_oldest();
}

std::uint64_t LruCache::memory_bytes(Kind kind) const {
  const std::lock_guard lock(mutex_);
  std::uint64_t bytes = 0;
  for (const auto& [name, entry] : entries_)
    if (name.kind == kind) bytes += entry.bytes;
  return bytes;
}

}  // namespace tracer
