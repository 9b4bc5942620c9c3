#include "tracer/mesh_file.h"

#include <charconv>
#include <cmath>
#include <limits>
#include <new>
#include <system_error>

#include "tracer/src/math/vec.h"
#include "tracer/src/mesh_io/formats.h"
#include "tracer/triangulate.h"
#include "tracer/validate.h"

namespace tracer {
namespace mesh_io {
namespace {

bool is_line_end(char c) { return c == '\n' || c == '\r'; }
bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }

void check_number(double number, double most, const char* limit) {
  if (std::abs(number) <= most) return;
  if (!std::isfinite(number)) throw MeshError("must be finite, got " + text_of(number));
  throw MeshError(std::string("the limit ") + limit + " is " + text_of(most) + ", got " + text_of(number));
}

Mesh read(Bytes bytes, const Limits& limits, bool smooth) {
  if (bytes.empty()) throw MeshError("is empty");
  if (is_ply(bytes)) return read_ply(bytes, limits);
  if (is_binary_stl(bytes)) return read_binary_stl(bytes, limits);
  if (is_ascii_stl(bytes)) return read_ascii_stl(bytes, limits);
  if (is_obj(bytes)) return read_obj(bytes, limits, smooth);
  throw MeshError("is no OBJ, PLY, STL or glTF file (a binary STL has 84 bytes and 50 for each triangle it declares)");
}

}  // namespace

std::string_view Tokenizer::next_token() {
  while (at_ < text_.size() && is_blank(text_[at_])) ++at_;
  const std::size_t first = at_;
  while (at_ < text_.size() && !is_blank(text_[at_]) && !is_line_end(text_[at_])) ++at_;
  return text_.substr(first, at_ - first);
}

std::string_view Tokenizer::next_token_across_continuations() {
  for (;;) {
    std::string_view found = next_token();
    const bool joined = found.ends_with('\\') && at_ < text_.size();  // a token ends at a blank or a line end
    if (!joined || !is_line_end(text_[at_])) return found;
    next_line();
    found.remove_suffix(1);
    if (!found.empty()) return found;
  }
}

std::string_view Tokenizer::next_token_on_any_line() {
  for (;;) {
    const std::string_view found = next_token();
    if (!found.empty() || !next_line()) return found;
  }
}

bool Tokenizer::next_line() {
  while (at_ < text_.size() && !is_line_end(text_[at_])) ++at_;
  if (at_ == text_.size()) return false;
  at_ += text_.substr(at_, 2) == "\r\n" ? 2 : 1;
  ++line_;
  return true;
}

std::optional<double> parse_number(std::string_view word) {
  if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end != word.data() + word.size() || error == std::errc::invalid_argument) return std::nullopt;
  if (error == std::errc::result_out_of_range) {  // overflow or underflow
    const bool tiny = word.find("e-") != std::string_view::npos || word.find("E-") != std::string_view::npos;
    value = tiny ? 0 : std::numeric_limits<double>::infinity();
  }
  return value;
}

double number_of(std::string_view word, const char* if_missing) {
  const std::optional<double> number = parse_number(word);
  if (!number) throw MeshError(word.empty() ? if_missing : in_quotes(word) + " is no number");
  return *number;
}

std::string at_line(std::size_t line) { return "line " + std::to_string(line); }

std::string in_quotes(std::string_view word) {
  constexpr std::size_t length_max = 32;
  std::string text = "\"";
  for (const char c : word.substr(0, length_max)) text += c >= ' ' && c <= '~' ? c : '?';
  return text + (word.size() > length_max ? "...\"" : "\"");
}

void check_vector(const Vec3& vector, const Limits& limits) {
  for (const double number : {vector.x, vector.y, vector.z})
    check_number(number, limits.coordinate_max, "coordinate_max");
}

void check_vector(const Vec2& uv, const Limits& limits) {
  for (const double number : {uv.x, uv.y}) check_number(number, limits.value_max, "value_max");
}

void check_triangle_count(std::uint64_t count, const Limits& limits) {
  if (count <= limits.triangles) return;
  throw MeshError("the limit triangles is " + std::to_string(limits.triangles) + ", it has at least " +
                  std::to_string(count));
}

void add_polygon(std::span<const std::uint32_t> indices, std::span<const Vec3> corners, const Limits& limits,
                 Mesh& mesh) {
  if (indices.size() < 3) throw MeshError("a face must have at least 3 corners, has " + std::to_string(indices.size()));
  check_triangle_count(mesh.triangles.size() + indices.size() - 2, limits);
  if (!tracer::add_polygon(indices, corners, mesh))
    throw MeshError("the limit ear_clipping_corners_max is " + std::to_string(ear_clipping_corners_max) +
                    " for faces that are no fan around their first corner (convex ones are), this one has " +
                    std::to_string(indices.size()));
}

}  // namespace mesh_io

Result<Mesh, std::string> read_mesh_file(std::span<const std::uint8_t> bytes, const Limits& limits, bool smooth) try {
  Mesh mesh = mesh_io::read(bytes, limits, smooth);
  if (mesh.triangles.empty()) return std::string("has no faces");
  add_missing_normals(mesh, limits);
  mesh.smooth = smooth;
  return mesh;
} catch (const mesh_io::MeshError& error) {
  return std::string(error.what());
} catch (const std::bad_alloc&) {
  return std::string("takes more memory than there is");
}

void add_missing_normals(Mesh& mesh, const Limits& limits) {
  if (mesh.normals.empty()) return;
  std::vector<bool> missing;
  missing.reserve(mesh.normals.size());
  bool any = false;
  for (const Vec3& normal : mesh.normals) {
    missing.push_back(!(max_component(abs(normal)) >= limits.length_min));
    any |= missing.back();
  }
  if (!any) return;
  for (auto& triangle : mesh.triangles) {
    const Vec3 a = mesh.positions[triangle[0]];
    const Vec3 across = cross(normalize(mesh.positions[triangle[1]] - a), normalize(mesh.positions[triangle[2]] - a));
    // No ray intersects a degenerate face: any direction is valid.
    const Vec3 normal = max_component(abs(across)) > 0 ? normalize(across) : Vec3{0, 0, 1};
    for (std::uint32_t& corner : triangle) {
      if (corner >= missing.size() || !missing[corner]) continue;
      if (max_component(abs(mesh.normals[corner])) < limits.length_min) {  // the first such face keeps the vertex
        mesh.normals[corner] = normal;
      } else if (mesh.normals[corner] != normal) {
        mesh.positions.push_back(mesh.positions[corner]);
        if (!mesh.uvs.empty()) mesh.uvs.push_back(mesh.uvs[corner]);
        mesh.normals.push_back(normal);
        corner = static_cast<std::uint32_t>(mesh.positions.size() - 1);
      }
    }
  }
}

}  // namespace tracer
