#pragma once
/// Welds equal keys by sorting: a hash table would be open to collision attacks.

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace tracer::mesh_io {

struct Welded {
  std::vector<std::uint32_t> first;   ///< index of the first occurrence of each distinct key; ascending
  std::vector<std::uint32_t> vertex;  ///< for each key, the index in `first` of its equal
};

/// Precondition: fewer than 2^32 keys, ordered by <.
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
  for (std::uint32_t i = 0; i < keys.size(); ++i) {  // the first of equal keys precedes the others
    const bool leads = welded.vertex[i] == i;
    const std::uint32_t follows = welded.vertex[i];
    welded.vertex[i] = leads ? static_cast<std::uint32_t>(welded.first.size()) : welded.vertex[follows];
    if (leads) welded.first.push_back(i);
  }
  return welded;
}

}  // namespace tracer::mesh_io
