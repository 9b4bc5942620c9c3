#pragma once
/// Makes equal things one, by sorting: no hash that a hostile file could fill with collisions.

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace tracer::mesh_io {

struct Welded {
  std::vector<std::uint32_t> first;   ///< of each different key, where it first stands; ascending
  std::vector<std::uint32_t> vertex;  ///< of each key, the place of its like in `first`
};

/// Keys are ordered by <; fewer than 2^32 of them.
template <class Key>
Welded weld(const std::vector<Key>& keys) {
  std::vector<std::pair<Key, std::uint32_t>> sorted;
  sorted.reserve(keys.size());
  for (const Key& key : keys) sorted.emplace_back(key, static_cast<std::uint32_t>(sorted.size()));
  std::sort(sorted.begin(), sorted.end());
  Welded welded;
  welded.vertex.resize(keys.size());
  for (std::size_t i = 0, leader = 0; i < sorted.size(); ++i) {
    if (sorted[leader].first < sorted[i].first) leader = i;
    welded.vertex[sorted[i].second] = sorted[leader].second;
  }
  for (std::uint32_t i = 0; i < keys.size(); ++i) {  // a leader comes before those that follow it
    const bool leads = welded.vertex[i] == i;
    const std::uint32_t follows = welded.vertex[i];
    welded.vertex[i] = leads ? static_cast<std::uint32_t>(welded.first.size()) : welded.vertex[follows];
    if (leads) welded.first.push_back(i);
  }
  return welded;
}

}  // namespace tracer::mesh_io
