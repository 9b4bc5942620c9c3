#pragma once
/// One reader per mesh format, and the tokenizer, checks and welding that they share; see tracer/mesh_file.h.
/// Everything here throws MeshError for an invalid file.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
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

// ---- text ----------------------------------------------------------------------------------------------------------

/// Lines end with LF, CRLF or CR and are counted from 1; tokens are separated by blanks and tabs. Returned views point
/// into the bytes, which must outlive them.
class Tokenizer {
 public:
  explicit Tokenizer(Bytes bytes) : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()) {}

  [[nodiscard]] std::size_t line() const { return line_; }
  [[nodiscard]] std::size_t offset() const { return at_; }  ///< bytes before the next token or line end

  /// The next token of this line; empty at its end.
  std::string_view next_token();
  /// The same, with lines joined by a backslash before the line end.
  std::string_view next_token_across_continuations();
  /// The next token of this or a later line; empty at the end of the file.
  std::string_view next_token_on_any_line();
  /// Advances to the next line; false if there is none.
  bool next_line();

 private:
  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
};

/// The nearest double of a decimal number, infinite or 0 beyond their range; nothing for other tokens.
std::optional<double> parse_number(std::string_view word);
/// The same; throws MeshError(`if_missing`) for an empty token, and another sentence for one that is no number.
double number_of(std::string_view word, const char* if_missing);

/// "line 7".
std::string at_line(std::size_t line);

/// The token in double quotes, at most 32 bytes of it, with '?' for control and non-ASCII characters.
std::string in_quotes(std::string_view word);

// ---- checks --------------------------------------------------------------------------------------------------------

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

/// tracer::add_polygon() within the limits.
void add_polygon(std::span<const std::uint32_t> indices, std::span<const Vec3> corners, const Limits& limits,
                 Mesh& mesh);

// ---- readers -------------------------------------------------------------------------------------------------------

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

// ---- welding -------------------------------------------------------------------------------------------------------

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
