#pragma once
/// The data of a PLY file as a sequence of numbers, whatever its encoding.

#include <cstdint>
#include <span>
#include <string>

#include "tracer/src/mesh_io/ply_header.h"

namespace tracer::mesh_io::ply {

class Values {
 public:
  /// `words` stand at the data of `bytes`.
  Values(std::span<const std::uint8_t> bytes, const Words& words, Encoding encoding);

  /// False where there is none; `refusal` says why.
  bool next(Type type, double& value);
  bool skip(Type type, std::uint64_t count);

  /// Whether the file can hold that many more, before memory is taken for them.
  [[nodiscard]] bool has_room_for(Type type, std::uint64_t count) const;
  /// The same for rows of an element, lists taken for empty.
  [[nodiscard]] bool has_room_for(const Element& element) const;

  [[nodiscard]] std::string place() const;  ///< "line 7" or "byte 129", of the value that comes next
  [[nodiscard]] const std::string& refusal() const { return refusal_; }

 private:
  bool next_word(double& value);
  /// Bytes of the file that a value takes at the least.
  [[nodiscard]] std::size_t least_bytes(Type type) const;
  [[nodiscard]] std::uint64_t bytes_left() const;

  std::span<const std::uint8_t> bytes_;
  Words words_;     ///< ASCII
  std::size_t at_;  ///< binary: the next value's first byte
  Encoding encoding_;
  std::string refusal_;
};

}  // namespace tracer::mesh_io::ply
