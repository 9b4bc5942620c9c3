#pragma once
/// Header of a PLY file, and its data as a sequence of numbers, for every encoding. Everything throws MeshError.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "tracer/src/mesh_io/formats.h"
#include "tracer/src/mesh_io/tokenizer.h"

namespace tracer::mesh_io::ply {

/// A type of numbers; see `types` in ply_data.cpp.
struct Type {
  std::string_view name, alias;  ///< "uchar", "uint8"
  std::size_t bytes;             ///< in binary files
  bool is_integer;
  double (*number)(const std::uint8_t* at, bool swapped);  ///< the value of these bytes
};

struct Property {
  std::string name;
  const Type* type = nullptr;
  const Type* count = nullptr;  ///< list: integer type of its length; null: one number
};

struct Element {
  std::string name;
  std::uint64_t count = 0;           ///< as declared, not checked against the file size
  std::vector<Property> properties;  ///< at least one if `count` > 0
};

class Data {
 public:
  /// Reads the header.
  explicit Data(Bytes bytes);

  /// In the order of the data; no name twice.
  [[nodiscard]] const std::vector<Element>& elements() const { return elements_; }

  double next(const Type& type);
  void skip(const Type& type, std::uint64_t count);

  /// True if the rest of the file can contain `count` values. Checked before allocation.
  [[nodiscard]] bool has_room_for(const Type& type, std::uint64_t count) const;
  /// The same for all rows of an element, with empty lists.
  [[nodiscard]] bool has_room_for(const Element& element) const;

  [[nodiscard]] std::string place() const;  ///< position of the next value: "line 7" or "byte 129"

 private:
  enum class Encoding : std::uint8_t { ascii, binary_little_endian, binary_big_endian };

  void read_header();
  void read_format();
  void read_element();
  void read_property();
  /// Minimum number of bytes of a value in the file: a digit and a blank, or its binary size.
  [[nodiscard]] std::size_t least_bytes(const Type& type) const {
    return encoding_ == Encoding::ascii ? 2 : type.bytes;
  }
  [[nodiscard]] std::uint64_t bytes_left() const;

  Bytes bytes_;
  Tokenizer tokens_;    ///< header, and data in ASCII
  std::size_t at_ = 0;  ///< binary data: first byte of the next value
  std::optional<Encoding> encoding_;
  std::vector<Element> elements_;
};

}  // namespace tracer::mesh_io::ply
