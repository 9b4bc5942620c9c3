#include <algorithm>
#include <bit>
#include <cstring>
#include <tuple>
#include <utility>

#include "tracer/src/mesh_io/formats.h"
#include "tracer/src/mesh_io/parse_numbers.h"
#include "tracer/src/mesh_io/tokenizer.h"
#include "tracer/src/mesh_io/weld.h"

namespace tracer::mesh_io {
namespace {

constexpr std::size_t header_bytes = 80;
constexpr std::size_t first_triangle = header_bytes + 4;
constexpr std::size_t triangle_bytes = 50;  // normal, three corners, a word that nothing defines
constexpr std::size_t normal_bytes = 12;

/// Little-endian, whatever this machine is.
std::uint32_t word_at(Bytes bytes, std::size_t offset) {
  std::uint32_t word = 0;
  for (std::size_t i = 4; i-- > 0;) word = word << 8U | bytes[offset + i];
  return word;
}

/// Corners, three a triangle, become vertices that neighbours share. -0 is 0: comparison says so, and so does weld.
Mesh welded_mesh(const std::vector<Vec3>& corners) {
  std::vector<std::tuple<double, double, double>> keys;
  keys.reserve(corners.size());
  for (const Vec3& corner : corners) keys.emplace_back(corner.x, corner.y, corner.z);
  const Welded welded = weld(keys);
  Mesh mesh;
  mesh.positions.reserve(welded.first.size());
  for (const std::uint32_t first : welded.first) mesh.positions.push_back(corners[first]);
  mesh.triangles.reserve(corners.size() / 3);
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3)
    mesh.triangles.push_back({welded.vertex[i], welded.vertex[i + 1], welded.vertex[i + 2]});
  return mesh;
}

std::string lower(std::string_view word) {
  std::string text(word);
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

class AsciiStlReader {
 public:
  AsciiStlReader(Bytes bytes, const Limits& limits) : words_(bytes), limits_(limits) {}

  MeshOrRefusal read() {
    for (std::string word; !(word = lower(words_.word_of_any_line())).empty();) {
      if (word == "solid" || word == "endsolid") {
        ended_ = word == "endsolid";
        if (!words_.next_line()) break;  // a name of any words may follow
      } else if (!(word == "facet" ? read_facet() : refuse(word, "facet"))) {
        return at_line(words_.line(), refusal_);
      }
    }
    if (!ended_) return at_line(words_.line(), "the file ends before \"endsolid\"");
    if (corner_points_.empty()) return std::string("has no facets");
    return welded_mesh(corner_points_);
  }

 private:
  bool refuse(std::string_view found, const char* expected) {
    refusal_ = std::string("expected ") + expected + ", found " + (found.empty() ? "the end" : in_quotes(found));
    return false;
  }

  bool expect(const char* keyword) {
    const std::string_view word = words_.word_of_any_line();
    return lower(word) == keyword || refuse(word, keyword);
  }

  bool read_number(double& number) {
    const std::string_view word = words_.word_of_any_line();
    return parse_number(word, number) || refuse(word, "a number");
  }

  bool read_vector(Vec3& v) { return read_number(v.x) && read_number(v.y) && read_number(v.z); }

  bool read_corner() {
    Vec3& corner = corner_points_.emplace_back();
    if (!expect("vertex") || !read_vector(corner)) return false;
    refusal_ = refusal_of(corner, limits_);
    return refusal_.empty();
  }

  bool read_facet() {
    refusal_ = refusal_of_triangle_count(corner_points_.size() / 3 + 1, limits_);
    Vec3 normal;
    return refusal_.empty() && expect("normal") && read_vector(normal) && expect("outer") && expect("loop") &&
           read_corner() && read_corner() && read_corner() && expect("endloop") && expect("endfacet");
  }

  Words words_;
  const Limits& limits_;
  std::string refusal_;
  bool ended_ = false;
  std::vector<Vec3> corner_points_;
};

}  // namespace

bool is_binary_stl(Bytes bytes) {
  return bytes.size() > first_triangle &&
         bytes.size() == first_triangle + triangle_bytes * std::uint64_t{word_at(bytes, header_bytes)};
}

MeshOrRefusal read_binary_stl(Bytes bytes, const Limits& limits) {
  const std::uint32_t count = word_at(bytes, header_bytes);
  if (auto refused = refusal_of_triangle_count(count, limits); !refused.empty()) return refused;
  std::vector<Vec3> corners;
  corners.reserve(std::size_t{3} * count);
  for (std::size_t triangle = 0; triangle < count; ++triangle) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::size_t offset = first_triangle + triangle * triangle_bytes + normal_bytes + corner * 12;
      const auto coordinate = [&](std::size_t axis) {
        return double{std::bit_cast<float>(word_at(bytes, offset + 4 * axis))};
      };
      corners.push_back({coordinate(0), coordinate(1), coordinate(2)});
      if (const auto refused = refusal_of(corners.back(), limits); !refused.empty())
        return "byte " + std::to_string(offset) + ": " + refused;
    }
  }
  return welded_mesh(corners);
}

/// Text has no NUL; the headers of binary files that begin with the same word do.
bool is_ascii_stl(Bytes bytes) {
  const Bytes beginning = bytes.first(std::min(bytes.size(), first_triangle));
  return std::find(beginning.begin(), beginning.end(), 0) == beginning.end() &&
         lower(Words(bytes).word_of_any_line()) == "solid";
}

MeshOrRefusal read_ascii_stl(Bytes bytes, const Limits& limits) { return AsciiStlReader(bytes, limits).read(); }

}  // namespace tracer::mesh_io
