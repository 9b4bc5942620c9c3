#pragma once
/// Names of files that share one property.

#include <cstddef>
#include <mutex>
#include <string>
#include <unordered_set>

namespace storage::files {

/// At most `names_max` of 100 bytes each; then all are removed. Thread-safe.
class NameSet {
 public:
  explicit NameSet(std::size_t names_max) : names_max_(names_max) {}
  void add(const std::string& name) {
    const std::lock_guard lock(mutex_);
    if (names_.size() >= names_max_) names_.clear();
    names_.insert(name);
  }
  void remove(const std::string& name) {
    const std::lock_guard lock(mutex_);
    names_.erase(name);
  }
  [[nodiscard]] bool contains(const std::string& name) const {
    const std::lock_guard lock(mutex_);
    return names_.contains(name);
  }

 private:
  const std::size_t names_max_;
  mutable std::mutex mutex_;
  std::unordered_set<std::string> names_;
};

}  // namespace storage::files
