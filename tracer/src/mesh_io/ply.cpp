#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "tracer/src/mesh_io/formats.h"
#include "tracer/src/mesh_io/ply_data.h"

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
    if (name == property.name && property.count == nullptr) return slot;
  return slots;
}

bool is_corner_list(const Property& property) {
  return property.count != nullptr && (property.name == "vertex_indices" || property.name == "vertex_index");
}

class PlyReader {
 public:
  PlyReader(Bytes bytes, const Limits& limits) : limits_(limits), data_(bytes) {}

  Mesh read() {
    located([&] { return data_.place(); },
            [&] {
              for (const Element& element : data_.elements()) read_element(element);
            });
    located([] { return "tristrips"; }, [&] { check_vertices(mesh_.triangles); });
    located([&] { return "face " + std::to_string(face_); },
            [&] {
              take_triangles();
              cut_polygons();
            });
    drop_unused_vertices();
    return std::move(mesh_);
  }

 private:
  void read_element(const Element& element) {
    if (!data_.has_room_for(element))
      throw MeshError("the file is too short for the " + std::to_string(element.count) + " elements " +
                      in_quotes(element.name) + " that its header declares");
    if (element.name == "vertex") return read_vertices(element);
    if (element.name == "face") return read_faces(element);
    for (std::uint64_t row = 0; row < element.count && !element.properties.empty(); ++row)
      for (const Property& property : element.properties)
        element.name == "tristrips" && is_corner_list(property) ? read_strip(property) : skip(property);
  }

  void skip(const Property& property) {
    data_.skip(*property.type, property.count != nullptr ? next_length(property) : 1);
  }

  std::uint64_t next_length(const Property& list) {
    const double number = data_.next(*list.count);
    if (!(number >= 0 && number <= max_index && number == std::trunc(number)))
      throw MeshError("the length of the list " + in_quotes(list.name) + " must be an integer >= 0");
    const auto length = static_cast<std::uint64_t>(number);
    if (!data_.has_room_for(*list.type, length))
      throw MeshError("the file is too short for the list " + in_quotes(list.name) + " of " + std::to_string(length));
    return length;
  }

  void read_vertices(const Element& element) {
    std::vector<Slot> slots_of_properties;
    std::array<bool, slots + 1> has{};
    for (const Property& property : element.properties) {
      slots_of_properties.push_back(slot_of(property));
      has[slots_of_properties.back()] = true;
    }
    if (!has[x] || !has[y] || !has[z]) throw MeshError("the element \"vertex\" must have x, y and z");
    const bool has_normals = has[nx] && has[ny] && has[nz], has_uvs = has[u] && has[v];
    mesh_.positions.reserve(element.count);
    if (has_normals) mesh_.normals.reserve(element.count);
    if (has_uvs) mesh_.uvs.reserve(element.count);
    std::array<double, slots + 1> row{};  // the last slot holds ignored properties
    for (std::uint64_t vertex = 0; vertex < element.count; ++vertex) {
      for (std::size_t i = 0; i < element.properties.size(); ++i) {
        const Property& property = element.properties[i];
        if (property.count != nullptr) {
          skip(property);
        } else {
          row[slots_of_properties[i]] = data_.next(*property.type);
        }
      }
      check_vector(mesh_.positions.emplace_back(Vec3{row[x], row[y], row[z]}), limits_);
      if (has_normals) check_vector(mesh_.normals.emplace_back(Vec3{row[nx], row[ny], row[nz]}), limits_);
      if (has_uvs) check_vector(mesh_.uvs.emplace_back(Vec2{row[u], row[v]}), limits_);
    }
  }

  /// Stored until all positions are read: faces may come first.
  void read_faces(const Element& element) {
    const auto corner_lists = std::ranges::count_if(element.properties, is_corner_list);
    if (corner_lists != 1) throw MeshError("the element \"face\" must have one list vertex_indices");
    faces_.reserve(element.count);
    for (std::uint64_t face = 0; face < element.count; ++face)
      for (const Property& property : element.properties)
        is_corner_list(property) ? read_corners(property) : skip(property);
  }

  double next_index(const Property& list, double least) {
    const double index = data_.next(*list.type);
    if (!(index >= least && index <= max_index && index == std::trunc(index)))
      throw MeshError("the index of a vertex must be an integer >= 0");
    return index;
  }

  void read_corners(const Property& list) {
    const std::uint64_t length = next_length(list);
    if (length == 3 && ends_.empty()) {
      for (std::uint32_t& corner : faces_.emplace_back()) corner = static_cast<std::uint32_t>(next_index(list, 0));
      return;
    }
    for (std::uint64_t i = 0; i < length; ++i)
      corner_points_.push_back(static_cast<std::uint32_t>(next_index(list, 0)));
    ends_.push_back(corner_points_.size());
  }

  /// Each index forms a triangle with the two before it, with alternating winding; -1 starts a new strip. Strips may be
  /// joined by repeated indices, which give no triangle.
  void read_strip(const Property& list) {
    std::array<std::uint32_t, 3> last{};
    std::uint64_t since_begin = 0;
    for (std::uint64_t left = next_length(list); left > 0; --left) {
      const double index = next_index(list, -1);
      if (index < 0) {
        since_begin = 0;
        continue;
      }
      last = {last[1], last[2], static_cast<std::uint32_t>(index)};
      const auto [a, b, c] = last;
      if (++since_begin < 3 || a == b || b == c || a == c) continue;
      mesh_.triangles.push_back(since_begin % 2 == 1 ? std::array{a, b, c} : std::array{b, a, c});
      check_triangle_count(mesh_.triangles.size(), limits_);
    }
  }

  void check_vertex(std::uint32_t index) const {
    if (index < mesh_.positions.size()) return;
    throw MeshError("must have the index of one of the " + std::to_string(mesh_.positions.size()) + " vertices, got " +
                    std::to_string(index));
  }

  void check_vertices(const std::vector<std::array<std::uint32_t, 3>>& triangles) const {
    for (const auto& triangle : triangles)
      for (const std::uint32_t corner : triangle) check_vertex(corner);
  }

  /// Triangles of strips come first, then the faces in file order.
  void take_triangles() {
    for (; face_ < faces_.size(); ++face_) {
      for (const std::uint32_t corner : faces_[face_]) check_vertex(corner);
      check_triangle_count(mesh_.triangles.size() + face_ + 1, limits_);
    }
    if (mesh_.triangles.empty()) {
      mesh_.triangles = std::move(faces_);
    } else {
      mesh_.triangles.insert(mesh_.triangles.end(), faces_.begin(), faces_.end());
    }
  }

  void cut_polygons() {
    std::vector<Vec3> positions;
    std::size_t begin = 0;
    for (const std::size_t end : ends_) {
      const std::span<const std::uint32_t> polygon(corner_points_.data() + begin, end - begin);
      positions.clear();
      for (const std::uint32_t corner : polygon) {
        check_vertex(corner);
        positions.push_back(mesh_.positions[corner]);
      }
      add_polygon(polygon, positions, limits_, mesh_);
      begin = end;
      ++face_;
    }
  }

  /// Removes unused positions: they would increase the scene's extent and memory.
  void drop_unused_vertices() {
    std::vector<bool> used(mesh_.positions.size());
    for (const auto& triangle : mesh_.triangles)
      for (const std::uint32_t corner : triangle) used[corner] = true;
    if (std::ranges::find(used, false) == used.end()) return;
    std::vector<std::uint32_t> renamed(used.size());
    std::uint32_t kept = 0;
    for (std::uint32_t i = 0; i < used.size(); ++i)
      if (used[i]) renamed[i] = kept++;
    const auto keep_used = [&](auto& values) {
      if (values.empty()) return;
      for (std::uint32_t i = 0; i < used.size(); ++i)
        if (used[i]) values[renamed[i]] = values[i];
      values.resize(kept);
    };
    keep_used(mesh_.positions);
    keep_used(mesh_.normals);
    keep_used(mesh_.uvs);
    for (auto& triangle : mesh_.triangles)
      for (std::uint32_t& corner : triangle) corner = renamed[corner];
  }

  static constexpr double max_index = std::numeric_limits<std::uint32_t>::max() - 1;

  const Limits& limits_;
  ply::Data data_;
  std::vector<std::array<std::uint32_t, 3>> faces_;  ///< all faces up to the first that is not a triangle
  std::vector<std::uint32_t> corner_points_;         ///< corners of all other faces, concatenated
  std::vector<std::size_t> ends_;                    ///< end of each of these in `corner_points_`
  std::size_t face_ = 0;                             ///< index of the current face in the file
  Mesh mesh_;
};

}  // namespace

bool is_ply(Bytes bytes) { return Tokenizer(bytes).next_token() == "ply"; }

Mesh read_ply(Bytes bytes, const Limits& limits) { return PlyReader(bytes, limits).read(); }

}  // namespace tracer::mesh_io
