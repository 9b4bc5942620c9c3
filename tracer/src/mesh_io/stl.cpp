#include <algorithm>
#include <bit>
#include <tuple>

#include "tracer/src/mesh_io/formats.h"

namespace tracer::mesh_io {
namespace {

constexpr std::size_t header_bytes = 80;
constexpr std::size_t first_triangle = header_bytes + 4;
constexpr std::size_t triangle_bytes = 50;  // normal, three corners, a 16-bit attribute
constexpr std::size_t normal_bytes = 12;

/// Little-endian on every machine.
std::uint32_t word_at(Bytes bytes, std::size_t offset) {
  std::uint32_t word = 0;
  for (std::size_t i = 4; i-- > 0;) word = word << 8U | bytes[offset + i];
  return word;
}

/// Welds corners, three per triangle, to vertices that neighbors share. -0 equals 0.
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
  AsciiStlReader(Bytes bytes, const Limits& limits) : tokens_(bytes), limits_(limits) {}

  Mesh read() {
    located([&] { return at_line(tokens_.line()); }, [&] { read_solids(); });
    if (corner_points_.empty()) throw MeshError("has no facets");
    return welded_mesh(corner_points_);
  }

 private:
  void read_solids() {
    bool ended = false;
    for (std::string_view word; !(word = tokens_.next_token_on_any_line()).empty();) {
      const std::string keyword = lower(word);
      if (keyword == "facet") {
        read_facet();
      } else if (keyword == "solid" || keyword == "endsolid") {
        ended = keyword == "endsolid";
        if (!tokens_.next_line()) break;  // skips the name
      } else {
        fail(word, "facet");
      }
    }
    if (!ended) throw MeshError("the file ends before \"endsolid\"");
  }

  [[noreturn]] static void fail(std::string_view found, const char* expected) {
    throw MeshError(std::string("expected ") + expected + ", found " + (found.empty() ? "the end" : in_quotes(found)));
  }

  void expect(const char* keyword) {
    const std::string_view word = tokens_.next_token_on_any_line();
    if (lower(word) != keyword) fail(word, keyword);
  }

  Vec3 next_vector() {
    Vec3 vector;
    for (double* coordinate : {&vector.x, &vector.y, &vector.z}) {
      const std::string_view word = tokens_.next_token_on_any_line();
      const std::optional<double> number = parse_number(word);
      if (!number) fail(word, "a number");
      *coordinate = *number;
    }
    return vector;
  }

  void read_facet() {
    check_triangle_count(corner_points_.size() / 3 + 1, limits_);
    expect("normal");
    next_vector();
    expect("outer");
    expect("loop");
    for (int corner = 0; corner < 3; ++corner) {
      expect("vertex");
      corner_points_.push_back(next_vector());
      check_vector(corner_points_.back(), limits_);
    }
    expect("endloop");
    expect("endfacet");
  }

  Tokenizer tokens_;
  const Limits& limits_;
  std::vector<Vec3> corner_points_;
};

}  // namespace

bool is_binary_stl(Bytes bytes) {
  return bytes.size() > first_triangle &&
         bytes.size() == first_triangle + triangle_bytes * std::uint64_t{word_at(bytes, header_bytes)};
}

Mesh read_binary_stl(Bytes bytes, const Limits& limits) {
  const std::uint32_t count = word_at(bytes, header_bytes);
  check_triangle_count(count, limits);
  std::vector<Vec3> corners;
  corners.reserve(std::size_t{3} * count);
  for (std::size_t triangle = 0; triangle < count; ++triangle) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::size_t offset = first_triangle + triangle * triangle_bytes + normal_bytes + corner * 12;
      const auto coordinate = [&](std::size_t axis) {
        return double{std::bit_cast<float>(word_at(bytes, offset + 4 * axis))};
      };
      corners.push_back({coordinate(0), coordinate(1), coordinate(2)});
      located([&] { return "byte " + std::to_string(offset); }, [&] { check_vector(corners.back(), limits); });
    }
  }
  return welded_mesh(corners);
}

/// Text contains no NUL; headers of binary files that begin with "solid" do.
bool is_ascii_stl(Bytes bytes) {
  const Bytes beginning = bytes.first(std::min(bytes.size(), first_triangle));
  return std::ranges::find(beginning, 0) == beginning.end() &&
         lower(Tokenizer(bytes).next_token_on_any_line()) == "solid";
}

Mesh read_ascii_stl(Bytes bytes, const Limits& limits) { return AsciiStlReader(bytes, limits).read(); }

}  // namespace tracer::mesh_io
