#pragma once
/// Reads the data of a PLY file as a sequence of numbers, for every encoding.

#include <cstdint>
#include <span>
#include <string>

#include "tracer/src/mesh_io/ply_header.h"

namespace tracer::mesh_io::ply {

class Values {
 public:
  /// `tokens` are positioned at the data of `bytes`.
  Values(std::span<const std::uint8_t> bytes, const Tokenizer& tokens, Encoding encoding);

  /// False at an error, which error() describes.
  bool next(Type type, double& value);
  bool skip(Type type, std::uint64_t count);

  /// True if the rest of the file can contain `count` values. Checked before allocation.
  [[nodiscard]] bool has_room_for(Type type, std::uint64_t count) const;
  /// The same for all rows of an element, with empty lists.
  [[nodiscard]] bool has_room_for(const Element& element) const;

  [[nodiscard]] std::string place() const;  ///< position of the next value: "line 7" or "byte 129"
  [[nodiscard]] const std::string& error() const { return error_; }

 private:
  bool next_token(double& value);
  /// Minimum number of bytes of a value in the file.
  [[nodiscard]] std::size_t least_bytes(Type type) const;
  [[nodiscard]] std::uint64_t bytes_left() const;

  std::span<const std::uint8_t> bytes_;
  Tokenizer tokens_;  ///< ASCII
  std::size_t at_;    ///< binary: the next value's first byte
  Encoding encoding_;
  std::string error_;
};

}  // namespace tracer::mesh_io::ply
