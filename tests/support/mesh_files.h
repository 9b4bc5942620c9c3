#pragma once
/// Small writers of mesh files, the other way round from the readers under test, and what every mesh read must keep.

#include <array>
#include <bit>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tracer/limits.h"
#include "tracer/scene.h"

namespace mesh_files {

using Bytes = std::vector<std::uint8_t>;
Bytes bytes_of(std::string_view text);

/// A pyramid over a square, with normals and uvs by position; all numbers are exact as floats and in few digits.
tracer::Mesh pyramid();

std::string obj(const tracer::Mesh& mesh);
std::string ascii_stl(const tracer::Mesh& mesh);
Bytes binary_stl(const tracer::Mesh& mesh);

enum class PlyEncoding { ascii, little_endian, big_endian };
/// Positions and faces as doubles and ints, or as floats and the shortest types, with normals and uvs.
Bytes ply(const tracer::Mesh& mesh, PlyEncoding encoding, bool wide);

/// Numbers of a binary file, byte by byte.
template <class T>
void append(Bytes& bytes, T value, bool big_endian = false) {
  const auto raw = std::bit_cast<std::array<std::uint8_t, sizeof(T)>>(value);  // this machine is little-endian
  if (big_endian) {
    bytes.insert(bytes.end(), raw.rbegin(), raw.rend());
  } else {
    bytes.insert(bytes.end(), raw.begin(), raw.end());
  }
}

struct Corner {
  tracer::Vec3 position{}, normal{};
  tracer::Vec2 uv{};
  bool operator==(const Corner&) const = default;
};
/// Three for each triangle, in order: the same for meshes that only number their vertices another way.
std::vector<Corner> corners(const tracer::Mesh& mesh);

/// What is wrong with a mesh that a reader gave: an index or a length that does not fit, a number out of bounds, a
/// position of no triangle; empty when nothing is.
std::string broken_promise(const tracer::Mesh& mesh, const tracer::Limits& limits);

}  // namespace mesh_files
