#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "tracer/mesh_file.h"
#include "tracer/src/mesh_io/formats.h"
#include "tracer/src/mesh_io/parse_numbers.h"
#include "tracer/src/mesh_io/ply_values.h"

namespace tracer::mesh_io {
namespace {

using ply::Element;
using ply::Property;

/// Vertex properties that are read, and their names in files.
enum Slot : std::size_t { x, y, z, nx, ny, nz, u, v, slots };
struct SlotName {
  std::string_view name;
  Slot slot;
};
constexpr SlotName slot_names[] = {{"x", x}, {"y", y}, {"z", z}, {"nx", nx}, {"ny", ny},       {"nz", nz},
                                   {"u", u}, {"v", v}, {"s", u}, {"t", v},   {"texture_u", u}, {"texture_v", v}};

Slot slot_of(const Property& property) {
  for (const auto& [name, slot] : slot_names)
    if (name == property.name && !property.count) return slot;
  return slots;
}

bool is_corner_list(const Property& property) {
  return property.count && (property.name == "vertex_indices" || property.name == "vertex_index");
}

class PlyReader {
 public:
  PlyReader(Bytes bytes, const Tokenizer& tokens, const ply::Header& header, const Limits& limits)
      : header_(header), limits_(limits), values_(bytes, tokens, header.encoding) {}

  MeshResult read() {
    for (const Element& element : header_.elements)
      if (!read_element(element)) return values_.place() + ": " + error_;
    if (!check_strips()) return "tristrips: " + error_;
    if (!make_triangles()) return "face " + std::to_string(face_) + ": " + error_;
    if (mesh_.triangles.empty()) return std::string("has no faces");
    drop_unused_vertices();
    add_missing_normals(mesh_, limits_);
    return std::move(mesh_);
  }

 private:
  bool check(std::string sentence) {
    error_ = std::move(sentence);
    return error_.empty();
  }

  bool next(ply::Type type, double& value) { return values_.next(type, value) || check(values_.error()); }

  bool read_element(const Element& element) {
    if (!values_.has_room_for(element)) {
      return check("the file is too short for the " + std::to_string(element.count) + " elements " +
                   in_quotes(element.name) + " that its header declares");
    }
    if (element.name == "vertex") return read_vertices(element);
    if (element.name == "face") return read_faces(element);
    if (element.name == "tristrips") return read_strips(element);
    for (std::uint64_t row = 0; row < element.count && !element.properties.empty(); ++row)
      for (const Property& property : element.properties)
        if (!skip(property)) return false;
    return true;
  }

  bool skip(const Property& property) {
    std::uint64_t length = 1;
    if (property.count && !read_length(property, length)) return false;
    return values_.skip(property.type, length) || check(values_.error());
  }

  bool read_length(const Property& list, std::uint64_t& length) {
    double number = 0;
    if (!next(*list.count, number)) return false;
    if (!(number >= 0 && number <= max_index && number == std::trunc(number)))
      return check("the length of the list " + in_quotes(list.name) + " must be an integer >= 0");
    length = static_cast<std::uint64_t>(number);
    return values_.has_room_for(list.type, length) ||
           check("the file is too short for the list " + in_quotes(list.name) + " of " + std::to_string(length));
  }

  bool read_vertices(const Element& element) {
    std::vector<Slot> slots_of_properties;
    std::array<bool, slots + 1> has{};
    for (const Property& property : element.properties) {
      slots_of_properties.push_back(slot_of(property));
      has[slots_of_properties.back()] = true;
    }
    if (!has[x] || !has[y] || !has[z]) return check("the element \"vertex\" must have x, y and z");
    const bool has_normals = has[nx] && has[ny] && has[nz], has_uvs = has[u] && has[v];
    mesh_.positions.reserve(element.count);
    if (has_normals) mesh_.normals.reserve(element.count);
    if (has_uvs) mesh_.uvs.reserve(element.count);
    std::array<double, slots + 1> row{};  // the last slot holds ignored properties
    for (std::uint64_t vertex = 0; vertex < element.count; ++vertex) {
      for (std::size_t i = 0; i < element.properties.size(); ++i) {
        const Property& property = element.properties[i];
        if (!(property.count ? skip(property) : next(property.type, row[slots_of_properties[i]]))) return false;
      }
      mesh_.positions.push_back({row[x], row[y], row[z]});
      if (has_normals) mesh_.normals.push_back({row[nx], row[ny], row[nz]});
      if (has_uvs) mesh_.uvs.push_back({row[u], row[v]});
      if (!check(vector_error(mesh_.positions.back(), limits_)) ||
          (has_normals && !check(vector_error(mesh_.normals.back(), limits_))) ||
          (has_uvs && !check(vector_error(mesh_.uvs.back(), limits_))))
        return false;
    }
    return true;
  }

  /// Stored until all positions are read: faces may come first.
  bool read_faces(const Element& element) {
    const auto corner_lists = std::count_if(element.properties.begin(), element.properties.end(), is_corner_list);
    if (corner_lists != 1) return check("the element \"face\" must have one list vertex_indices");
    faces_.reserve(element.count);
    for (std::uint64_t face = 0; face < element.count; ++face) {
      for (const Property& property : element.properties)
        if (!(is_corner_list(property) ? read_corners(property) : skip(property))) return false;
    }
    return true;
  }

  bool read_index(const Property& list, double least, double& index) {
    if (!next(list.type, index)) return false;
    return (index >= least && index <= max_index && index == std::trunc(index)) ||
           check("the index of a vertex must be an integer >= 0");
  }

  bool read_corners(const Property& list) {
    std::uint64_t length = 0;
    if (!read_length(list, length)) return false;
    const bool is_triangle = length == 3 && ends_.empty();
    std::array<std::uint32_t, 3> triangle{};
    for (std::uint64_t i = 0; i < length; ++i) {
      double index = 0;
      if (!read_index(list, 0, index)) return false;
      if (is_triangle) {
        triangle[i] = static_cast<std::uint32_t>(index);
      } else {
        corner_points_.push_back(static_cast<std::uint32_t>(index));
      }
    }
    if (is_triangle) {
      faces_.push_back(triangle);
    } else {
      ends_.push_back(corner_points_.size());
    }
    return true;
  }

  bool read_strips(const Element& element) {
    for (std::uint64_t row = 0; row < element.count; ++row)
      for (const Property& property : element.properties)
        if (!(is_corner_list(property) ? read_strip(property) : skip(property))) return false;
    return true;
  }

  /// Each index forms a triangle with the two before it, with alternating winding; -1 starts a new strip. Strips may be
  /// joined by repeated indices, which give no triangle.
  bool read_strip(const Property& list) {
    std::uint64_t length = 0;
    if (!read_length(list, length)) return false;
    std::array<std::uint32_t, 3> last{};
    std::uint64_t since_begin = 0;
    for (std::uint64_t i = 0; i < length; ++i) {
      double index = 0;
      if (!read_index(list, -1, index)) return false;
      if (index < 0) {
        since_begin = 0;
        continue;
      }
      last = {last[1], last[2], static_cast<std::uint32_t>(index)};
      const auto [a, b, c] = last;
      if (++since_begin < 3 || a == b || b == c || a == c) continue;
      mesh_.triangles.push_back(since_begin % 2 == 1 ? std::array{a, b, c} : std::array{b, a, c});
      if (!check(triangle_count_error(mesh_.triangles.size(), limits_))) return false;
    }
    return true;
  }

  bool is_vertex(std::uint32_t index) {
    return index < mesh_.positions.size() ||
           check("must have the index of one of the " + std::to_string(mesh_.positions.size()) + " vertices, got " +
                 std::to_string(index));
  }

  bool check_strips() {
    for (const auto& triangle : mesh_.triangles)
      for (const std::uint32_t corner : triangle)
        if (!is_vertex(corner)) return false;
    return true;
  }

  /// Triangles of strips come first, then the faces in file order.
  bool make_triangles() { return take_triangles() && cut_polygons(); }

  bool take_triangles() {
    const std::uint64_t before = mesh_.triangles.size();
    for (; face_ < faces_.size(); ++face_) {
      const auto& [a, b, c] = faces_[face_];
      if (!is_vertex(a) || !is_vertex(b) || !is_vertex(c)) return false;
      if (before + face_ >= limits_.triangles) return check(triangle_count_error(before + face_ + 1, limits_));
    }
    if (before == 0) {
      mesh_.triangles = std::move(faces_);
    } else {
      mesh_.triangles.insert(mesh_.triangles.end(), faces_.begin(), faces_.end());
    }
    return true;
  }

  bool cut_polygons() {
    std::vector<Vec3> positions;
    std::size_t begin = 0;
    for (const std::size_t end : ends_) {
      const std::span<const std::uint32_t> polygon(corner_points_.data() + begin, end - begin);
      positions.clear();
      for (const std::uint32_t corner : polygon) {
        if (!is_vertex(corner)) return false;
        positions.push_back(mesh_.positions[corner]);
      }
      if (!check(add_polygon(polygon, positions, limits_, mesh_.triangles))) return false;
      begin = end;
      ++face_;
    }
    return true;
  }

  /// Removes unused positions: they would increase the scene's extent and memory.
  void drop_unused_vertices() {
    std::vector<bool> used(mesh_.positions.size());
    for (const auto& triangle : mesh_.triangles)
      for (const std::uint32_t corner : triangle) used[corner] = true;
    if (std::find(used.begin(), used.end(), false) == used.end()) return;
    std::vector<std::uint32_t> renamed(used.size());
    std::uint32_t kept = 0;
    for (std::uint32_t i = 0; i < used.size(); ++i) {
      if (!used[i]) continue;
      mesh_.positions[kept] = mesh_.positions[i];
      if (!mesh_.normals.empty()) mesh_.normals[kept] = mesh_.normals[i];
      if (!mesh_.uvs.empty()) mesh_.uvs[kept] = mesh_.uvs[i];
      renamed[i] = kept++;
    }
    mesh_.positions.resize(kept);
    if (!mesh_.normals.empty()) mesh_.normals.resize(kept);
    if (!mesh_.uvs.empty()) mesh_.uvs.resize(kept);
    for (auto& triangle : mesh_.triangles)
      for (std::uint32_t& corner : triangle) corner = renamed[corner];
  }

  static constexpr double max_index = std::numeric_limits<std::uint32_t>::max() - 1;

  const ply::Header& header_;
  const Limits& limits_;
  ply::Values values_;
  std::string error_;
  std::vector<std::array<std::uint32_t, 3>> faces_;  ///< all faces up to the first that is not a triangle
  std::vector<std::uint32_t> corner_points_;         ///< corners of all other faces, concatenated
  std::vector<std::size_t> ends_;                    ///< end of each of these in `corner_points_`
  std::size_t face_ = 0;                             ///< index of the current face in the file
  Mesh mesh_;
};

}  // namespace

bool is_ply(Bytes bytes) { return Tokenizer(bytes).next_token() == "ply"; }

MeshResult read_ply(Bytes bytes, const Limits& limits) {
  Tokenizer tokens(bytes);
  auto header = ply::read_header(tokens);
  if (!header) return std::move(header.error());
  return PlyReader(bytes, tokens, *header, limits).read();
}

}  // namespace tracer::mesh_io
