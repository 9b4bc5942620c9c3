#pragma once
/// One reader per mesh format, and the checks that they share; see tracer/mesh_file.h. Everything here throws MeshError
/// for an invalid file.

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tracer/limits.h"
#include "tracer/scene.h"

namespace tracer::mesh_io {

using Bytes = std::span<const std::uint8_t>;

/// A sentence for people. An exception, because a reader can fail at every token; read_mesh_file returns it as a value.
struct MeshError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Calls `read`, and puts `place()` in front of the sentence of a MeshError: "line 7: must be finite, got inf".
template <class Place, class Read>
void located(const Place& place, const Read& read) try {
  read();
} catch (const MeshError& error) {
  throw MeshError(std::string(place()) + ": " + error.what());
}

/// Positions and normals: |coordinate| is at most coordinate_max.
void check_vector(const Vec3& vector, const Limits& limits);
/// Texture coordinates: |component| is at most value_max.
void check_vector(const Vec2& uv, const Limits& limits);
void check_triangle_count(std::uint64_t count, const Limits& limits);

/// Appends the triangles of a polygon as elements of `indices`; `corners` are its positions, in the same order.
void add_polygon(std::span<const std::uint32_t> indices, std::span<const Vec3> corners, const Limits& limits,
                 std::vector<std::array<std::uint32_t, 3>>& triangles);

/// Wavefront OBJ, "Object Files (.obj)", Advanced Visualizer manual, appendix B1. Detected if the first token outside
/// of comments is one of its keywords.
bool is_obj(Bytes bytes);
Mesh read_obj(Bytes bytes, const Limits& limits, bool smooth);

/// G. Turk, "The PLY polygon file format", 1994.
bool is_ply(Bytes bytes);
Mesh read_ply(Bytes bytes, const Limits& limits);

/// 3D Systems, StereoLithography interface specification, 1989. Binary files are detected by their size, because many
/// begin with the keyword of ASCII files.
bool is_binary_stl(Bytes bytes);
Mesh read_binary_stl(Bytes bytes, const Limits& limits);
bool is_ascii_stl(Bytes bytes);
Mesh read_ascii_stl(Bytes bytes, const Limits& limits);

/// Result of weld().
struct Welded {
  std::vector<std::uint32_t> first;   ///< index of the first occurrence of each distinct key; ascending
  std::vector<std::uint32_t> vertex;  ///< for each key, the index in `first` of its equal
};

/// Welds equal keys by sorting: a hash table would be open to collision attacks. Precondition: fewer than 2^32 keys,
/// ordered by <.
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
