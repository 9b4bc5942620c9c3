#pragma once
/// A cache by name.

#include <cstddef>
#include <iterator>
#include <list>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

namespace http::handlers {

/// The values that were used least recently are dropped while the sum of the sizes exceeds `size_max`. Thread-safe.
template <class Value>
class LruCache {
 public:
  explicit LruCache(std::size_t size_max) : size_max_(size_max) {}

  std::optional<Value> find(const std::string& name) {
    const std::lock_guard lock(mutex_);
    const auto found = by_name_.find(name);
    if (found == by_name_.end()) return std::nullopt;
    entries_.splice(entries_.begin(), entries_, found->second);
    return found->second->value;
  }

  /// In place of an earlier one of the same name.
  void add(const std::string& name, Value value, std::size_t size) {
    const std::lock_guard lock(mutex_);
    if (const auto found = by_name_.find(name); found != by_name_.end()) drop(found->second);
    entries_.push_front({name, std::move(value), size});
    by_name_.emplace(name, entries_.begin());
    for (size_ += size; size_ > size_max_ && entries_.size() > 1;) drop(std::prev(entries_.end()));
  }

 private:
  struct Entry {
    std::string name;
    Value value;
    std::size_t size = 0;
  };

  void drop(typename std::list<Entry>::iterator entry) {
    size_ -= entry->size;
    by_name_.erase(entry->name);
    entries_.erase(entry);
  }

  const std::size_t size_max_;
  std::mutex mutex_;
  std::list<Entry> entries_;  ///< latest use first
  std::unordered_map<std::string, typename std::list<Entry>::iterator> by_name_;
  std::size_t size_ = 0;
};

}  // namespace http::handlers
