#include "tests/support/mesh_files.h"

#include <cmath>
#include <sstream>

namespace mesh_files {
namespace {

using tracer::Mesh;
using tracer::Vec3;

std::string vector(const Vec3& v) {
  std::ostringstream text;
  text.precision(17);
  text << v.x << ' ' << v.y << ' ' << v.z;
  return text.str();
}

/// Writes numbers one after the other, as text or binary.
class PlyData {
 public:
  explicit PlyData(PlyEncoding encoding) : encoding_(encoding) {}

  template <class T>
  void add(T value) {
    if (encoding_ == PlyEncoding::ascii) {
      std::ostringstream word;
      word.precision(17);
      word << +value << ' ';
      for (const char c : word.str()) bytes.push_back(static_cast<std::uint8_t>(c));
    } else {
      append(bytes, value, encoding_ == PlyEncoding::big_endian);
    }
  }
  void end_row() {
    if (encoding_ == PlyEncoding::ascii) bytes.back() = '\n';
  }

  Bytes bytes;

 private:
  PlyEncoding encoding_;
};

template <class Real, class Length, class Index>
void add_ply_rows(const Mesh& mesh, PlyData& data) {
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const Vec3 &p = mesh.positions[i], &n = mesh.normals[i];
    for (const double value : {p.x, p.y, p.z, n.x, n.y, n.z, mesh.uvs[i].x, mesh.uvs[i].y})
      data.add(static_cast<Real>(value));
    data.end_row();
  }
  for (const auto& triangle : mesh.triangles) {
    data.add(Length{3});
    for (const std::uint32_t corner : triangle) data.add(static_cast<Index>(corner));
    data.end_row();
  }
}

bool within(const Vec3& v, double most) {
  return std::abs(v.x) <= most && std::abs(v.y) <= most && std::abs(v.z) <= most;
}

}  // namespace

Bytes bytes_of(std::string_view text) { return {text.begin(), text.end()}; }

Mesh pyramid() {
  Mesh mesh;
  mesh.positions = {{-1, 0, -1}, {1, 0, -1}, {1, 0, 1}, {-1, 0, 1}, {0.25, 1.5, -0.125}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 4, 1}, {1, 4, 2}, {2, 4, 3}, {3, 4, 0}};
  mesh.normals = {{-1, -0.5, -1}, {1, -0.5, -1}, {1, -0.5, 1}, {-1, -0.5, 1}, {0, 1, 0}};
  mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {0.5, 0.625}};
  return mesh;
}

std::string obj(const Mesh& mesh) {
  std::ostringstream text;
  text.precision(17);
  for (const Vec3& p : mesh.positions) text << "v " << vector(p) << '\n';
  for (const tracer::Vec2& uv : mesh.uvs) text << "vt " << uv.x << ' ' << uv.y << '\n';
  for (const Vec3& n : mesh.normals) text << "vn " << vector(n) << '\n';
  for (const auto& triangle : mesh.triangles) {
    text << 'f';
    for (const std::uint32_t corner : triangle) text << ' ' << corner + 1 << '/' << corner + 1 << '/' << corner + 1;
    text << '\n';
  }
  return text.str();
}

std::string ascii_stl(const Mesh& mesh) {
  std::string text = "solid a pyramid\n";
  for (const auto& triangle : mesh.triangles) {
    text += " facet normal 0 0 0\n  outer loop\n";
    for (const std::uint32_t corner : triangle) text += "   vertex " + vector(mesh.positions[corner]) + "\n";
    text += "  endloop\n endfacet\n";
  }
  return text + "endsolid a pyramid\n";
}

Bytes binary_stl(const Mesh& mesh) {
  Bytes bytes = bytes_of("solid, says this header, and yet it is binary");
  bytes.resize(80);
  append(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& triangle : mesh.triangles) {
    for (int i = 0; i < 3; ++i) append(bytes, 0.0F);
    for (const std::uint32_t corner : triangle) {
      const Vec3& p = mesh.positions[corner];
      for (const double coordinate : {p.x, p.y, p.z}) append(bytes, static_cast<float>(coordinate));
    }
    append(bytes, std::uint16_t{0});
  }
  return bytes;
}

Bytes ply(const Mesh& mesh, PlyEncoding encoding, bool wide) {
  constexpr const char* names[] = {"ascii", "binary_little_endian", "binary_big_endian"};
  const std::string real = wide ? "double" : "float";
  std::string header = std::string("ply\nformat ") + names[static_cast<int>(encoding)] + " 1.0\ncomment by a test\n";
  header += "element vertex " + std::to_string(mesh.positions.size()) + "\n";
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "s", "t"}) header += "property " + real + " " + name + "\n";
  header += "element face " + std::to_string(mesh.triangles.size()) + "\nproperty list ";
  header += wide ? "int int vertex_index\n" : "uchar uchar vertex_indices\n";
  PlyData data(encoding);
  if (wide) {
    add_ply_rows<double, std::int32_t, std::int32_t>(mesh, data);
  } else {
    add_ply_rows<float, std::uint8_t, std::uint8_t>(mesh, data);
  }
  Bytes bytes = bytes_of(header + "end_header\n");
  bytes.insert(bytes.end(), data.bytes.begin(), data.bytes.end());
  return bytes;
}

std::vector<Corner> corners(const Mesh& mesh) {
  std::vector<Corner> all;
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t i : triangle)
      all.push_back({mesh.positions.at(i), mesh.normals.empty() ? Vec3{} : mesh.normals.at(i),
                     mesh.uvs.empty() ? tracer::Vec2{} : mesh.uvs.at(i)});
  return all;
}

std::string broken_promise(const Mesh& mesh, const tracer::Limits& limits) {
  const std::size_t count = mesh.positions.size();
  if (mesh.triangles.empty()) return "no triangles";
  if (mesh.triangles.size() > limits.triangles) return "more triangles than the limit";
  if (!mesh.normals.empty() && mesh.normals.size() != count) return "as many normals as positions";
  if (!mesh.uvs.empty() && mesh.uvs.size() != count) return "as many uvs as positions";
  std::vector<bool> used(count);
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle) {
      if (corner >= count) return "indices of positions";
      used[corner] = true;
    }
  for (const bool one : used)
    if (!one) return "positions that triangles have";
  for (const Vec3& p : mesh.positions)
    if (!within(p, limits.coordinate_max)) return "positions within their limit";
  for (const Vec3& n : mesh.normals)
    if (!within(n, limits.coordinate_max) || within(n, limits.length_min / 2)) return "normals with a direction";
  for (const tracer::Vec2& uv : mesh.uvs)
    if (!within({uv.x, uv.y, 0}, limits.value_max)) return "uvs within their limit";
  for (std::size_t i = 0; i < mesh.parts.size(); ++i) {
    const std::size_t end = i + 1 < mesh.parts.size() ? mesh.parts[i + 1].first : mesh.triangles.size();
    if (mesh.parts[i].first >= end) return "parts with triangles, in order";
  }
  return "";
}

}  // namespace mesh_files
