#pragma once
/// Scaled images by the content of their source.

#include <algorithm>
#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

namespace http::handlers {

/// The least recently used ones are dropped beyond `bytes_max`. Thread-safe.
class ThumbnailCache {
 public:
  using Png = std::shared_ptr<const std::string>;
  static constexpr std::size_t bytes_max = 64u << 20;  ///< those of 2000 frames

  /// Null if it is not kept.
  Png find(const std::string& key) {
    const std::lock_guard lock(mutex_);
    const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const auto& e) { return e.first == key; });
    if (found == entries_.end()) return nullptr;
    entries_.splice(entries_.begin(), entries_, found);
    return found->second;
  }

  void add(const std::string& key, Png png) {
    const std::lock_guard lock(mutex_);
    bytes_ += png->size();
    entries_.emplace_front(key, std::move(png));
    for (; bytes_ > bytes_max && entries_.size() > 1; entries_.pop_back()) bytes_ -= entries_.back().second->size();
  }

 private:
  std::mutex mutex_;
  std::list<std::pair<std::string, Png>> entries_;  ///< latest use first
  std::size_t bytes_ = 0;
};

}  // namespace http::handlers
