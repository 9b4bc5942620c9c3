#include "tracer/src/compile/lru_cache.h"

#include <chrono>
#include <utility>

namespace tracer {

LruCache::BuildTicket::~BuildTicket() {
  if (cache_ && !found_) cache_->release_ticket(key_, nullptr, 0);
}

void LruCache::BuildTicket::store(Value value, std::uint64_t bytes) {
  const std::shared_ptr<LruCache> cache = std::move(cache_);
  cache->release_ticket(key_, std::move(value), bytes);
}

Result<LruCache::BuildTicket, Failure> LruCache::acquire(const Key& key, const RenderControl& control) {
  constexpr std::chrono::milliseconds poll_interval{10};  // RenderControl has no callback
  std::unique_lock lock(mutex_);
  for (;;) {
    const auto [entry, is_new] = entries_.try_emplace(key);
    if (is_new) return BuildTicket(shared_from_this(), key, nullptr);
    if (entry->second.value) {
      entry->second.used = ++uses_;
      return BuildTicket(shared_from_this(), key, entry->second.value);
    }
    if (control.cancelled()) return Failure{Failure::Code::cancelled, "cancelled while another scene built the same"};
    released_.wait_for(lock, poll_interval);
  }
}

/// A null or too large value is not stored: the next waiting caller builds it.
void LruCache::release_ticket(const Key& key, Value value, std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  if (value && bytes <= bytes_max_) {
    while (bytes_ > bytes_max_ - bytes) evict_oldest();
    entries_[key] = {std::move(value), bytes, ++uses_};
    bytes_ += bytes;
  } else {
    entries_.erase(key);
  }
  released_.notify_all();
}

/// Precondition: bytes_ > 0.
void LruCache::evict_oldest() {
  auto oldest = entries_.end();
  for (auto entry = entries_.begin(); entry != entries_.end(); ++entry)
    if (entry->second.value && (oldest == entries_.end() || entry->second.used < oldest->second.used)) oldest = entry;
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
  for (const auto& [key, entry] : entries_)
    if (key.kind == kind) bytes += entry.bytes;
  return bytes;
}

}  // namespace tracer
