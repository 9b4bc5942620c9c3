#pragma once
/// Writers of mesh files for tests of the readers, and the invariants of every mesh.

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
/// Positions of the triangles' corners in order: equal for meshes that differ only in the numbering of vertices.
std::vector<Corner> corners(const tracer::Mesh& mesh);

/// Violated invariant of a mesh: an index or a length that does not fit, a number out of bounds, an unused position;
/// empty if there is none.
std::string broken_promise(const tracer::Mesh& mesh, const tracer::Limits& limits);

}  // namespace mesh_files
