#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "tracer/mesh_file.h"
#include "tracer/src/math/vec.h"
#include "tracer/src/mesh_io/formats.h"

namespace tracer::mesh_io {
namespace {

constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

/// Indices from 0; `none` if the file has none.
struct Corner {
  std::uint32_t position = none, uv = none, normal = none;
  auto operator<=>(const Corner&) const = default;  // NOLINT(modernize-use-nullptr): of what the compiler writes
};

class ObjReader {
 public:
  ObjReader(Bytes bytes, const Limits& limits, bool smooth) : tokens_(bytes), limits_(limits), smooth_(smooth) {}

  Mesh read() {
    do {
      const std::size_t line = tokens_.line();  // the first of joined lines
      located([line] { return at_line(line); }, [&] { read_line(); });
    } while (tokens_.next_line());
    if (smooth_ && has_uvs_ && !has_normals_) add_smooth_normals();
    make_vertices();
    return std::move(mesh_);
  }

 private:
  /// Skips everything but geometry and the names of materials, including material files.
  void read_line() {
    const std::string_view keyword = tokens_.next_token();
    if (keyword == "v") read_vector(positions_);
    if (keyword == "vt") read_uv();
    if (keyword == "vn") read_vector(normals_);
    if (keyword == "f") read_face();
    if (keyword == "usemtl") read_material_name();
  }

  /// Next token of this line; empty at its end and at a comment.
  std::string_view next_token() {
    const std::string_view word = tokens_.next_token_across_continuations();
    return word.starts_with('#') ? std::string_view() : word;
  }

  double next_number() { return number_of(next_token(), "a number is missing"); }

  /// Ignores the rest of the line (weight, color).
  void read_vector(std::vector<Vec3>& vectors) {
    Vec3& v = vectors.emplace_back();
    for (double* coordinate : {&v.x, &v.y, &v.z}) *coordinate = next_number();
    check_vector(v, limits_);
  }

  void read_uv() {
    Vec2& uv = uvs_.emplace_back();
    uv.x = next_number();
    const std::string_view second = next_token();  // v is optional, default 0
    if (!second.empty()) uv.y = number_of(second, "");
    check_vector(uv, limits_);
  }

  /// Blanks within the name count as one.
  void read_material_name() {
    material_.clear();
    for (std::string_view word; !(word = next_token()).empty();) {
      if (!material_.empty()) material_ += ' ';
      material_ += word;
    }
  }

  void read_face() {
    begin_part(mesh_, material_);
    polygon_.clear();
    polygon_positions_.clear();
    for (std::string_view word; !(word = next_token()).empty();) {
      const Corner corner = corner_of(word);
      polygon_.push_back(static_cast<std::uint32_t>(corner_points_.size()));
      polygon_positions_.push_back(positions_[corner.position]);
      corner_points_.push_back(corner);
      has_uvs_ |= corner.uv != none;
      has_normals_ |= corner.normal != none;
    }
    add_polygon(polygon_, polygon_positions_, limits_, mesh_);
  }

  /// Forms: v, v/vt, v//vn, v/vt/vn.
  [[nodiscard]] Corner corner_of(std::string_view word) const {
    const std::string_view whole = word;
    const auto next_part = [&word] {
      const std::size_t slash = std::min(word.find('/'), word.size());
      const std::string_view part = word.substr(0, slash);
      word.remove_prefix(std::min(slash + 1, word.size()));
      return part;
    };
    const std::string_view position = next_part(), uv = next_part(), normal = next_part();
    if (!word.empty()) throw MeshError(in_quotes(whole) + " is no corner of a face");
    return {index_of(position, positions_.size(), "positions"),
            uv.empty() ? none : index_of(uv, uvs_.size(), "texture coordinates"),
            normal.empty() ? none : index_of(normal, normals_.size(), "normals")};
  }

  /// Positive indices count from 1, negative ones back from the last element so far (-1).
  static std::uint32_t index_of(std::string_view word, std::size_t count, const char* of) {
    double number = parse_number(word).value_or(NAN);
    const auto most = static_cast<double>(count);
    if (number != std::trunc(number)) throw MeshError(in_quotes(word) + " is no index");
    if (number < 0) number += most + 1;
    if (!(number >= 1 && number <= most))
      throw MeshError("must be the index of one of the " + std::to_string(count) + " " + of + " so far, got " +
                      in_quotes(word));
    return static_cast<std::uint32_t>(number) - 1;
  }

  /// Area-weighted normals per position: a vertex that is split at a uv seam is still one point of the surface. The
  /// same formula as for meshes without normals.
  void add_smooth_normals() {
    normals_.assign(positions_.size(), {});
    for (const auto& triangle : mesh_.triangles) {
      const auto position = [&](std::size_t i) { return corner_points_[triangle[i]].position; };
      const Vec3 a = positions_[position(0)];
      const Vec3 weighted = cross(positions_[position(1)] - a, positions_[position(2)] - a);
      for (std::size_t i = 0; i < 3; ++i) normals_[position(i)] += weighted;
    }
    for (Vec3& normal : normals_) normal = normalize(normal);
    for (Corner& corner : corner_points_) corner.normal = corner.position;
    has_normals_ = true;
  }

  void make_vertices() {
    const Welded welded = weld(corner_points_);
    for (auto& triangle : mesh_.triangles)
      for (std::uint32_t& corner : triangle) corner = welded.vertex[corner];
    for (const std::uint32_t first : welded.first) {
      const Corner& corner = corner_points_[first];
      mesh_.positions.push_back(positions_[corner.position]);
      if (has_uvs_) mesh_.uvs.push_back(corner.uv == none ? Vec2{} : uvs_[corner.uv]);
      if (has_normals_) mesh_.normals.push_back(corner.normal == none ? Vec3{} : normals_[corner.normal]);
    }
  }

  Tokenizer tokens_;
  const Limits& limits_;
  bool smooth_;
  std::vector<Vec3> positions_, normals_;
  std::vector<Vec2> uvs_;
  std::vector<Corner> corner_points_;  ///< corners of all faces; triangles index them until they are welded
  std::string material_;               ///< the name for the faces that follow
  std::vector<std::uint32_t> polygon_;
  std::vector<Vec3> polygon_positions_;
  bool has_uvs_ = false, has_normals_ = false;
  Mesh mesh_;
};

}  // namespace

bool is_obj(Bytes bytes) {
  constexpr std::string_view keywords[] = {"v",  "vt",    "vn",       "vp",       "f",      "l",      "p",
                                           "o",  "g",     "s",        "mg",       "mtllib", "usemtl", "usemap",
                                           "fo", "bevel", "c_interp", "d_interp", "lod"};
  Tokenizer tokens(bytes);
  do {
    const std::string_view word = tokens.next_token();
    if (!word.empty() && !word.starts_with('#')) return std::ranges::find(keywords, word) != std::end(keywords);
  } while (tokens.next_line());
  return false;
}

Mesh read_obj(Bytes bytes, const Limits& limits, bool smooth) { return ObjReader(bytes, limits, smooth).read(); }

}  // namespace tracer::mesh_io
