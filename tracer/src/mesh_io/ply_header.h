#pragma once
/// Header of a PLY file.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tracer/result.h"
#include "tracer/src/mesh_io/tokenizer.h"

namespace tracer::mesh_io::ply {

enum class Type : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
constexpr std::size_t bytes_of(Type type) {
  constexpr std::size_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return sizes[static_cast<std::size_t>(type)];
}

struct Property {
  std::string name;
  Type type = Type::float32;
  std::optional<Type> count{};  ///< list: integer type of its length
};

struct Element {
  std::string name;
  std::uint64_t count = 0;           ///< as declared, not checked against the file size
  std::vector<Property> properties;  ///< at least one if `count` > 0
};

enum class Encoding : std::uint8_t { ascii, little_endian, big_endian };

struct Header {
  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements;  ///< in the order of the data; no name twice
};

/// Advances `tokens` to the data. Fails with a sentence that begins with the line.
Result<Header, std::string> read_header(Tokenizer& tokens);

}  // namespace tracer::mesh_io::ply
