#include "tracer/src/mesh_io/ply_values.h"

#include <bit>

namespace tracer::mesh_io::ply {
namespace {

/// Two's complement; IEEE 754.
double number(Type type, std::uint64_t bits) {
  switch (type) {
    case Type::int8:
      return static_cast<std::int8_t>(bits);
    case Type::int16:
      return static_cast<std::int16_t>(bits);
    case Type::int32:
      return static_cast<std::int32_t>(bits);
    case Type::uint8:
    case Type::uint16:
    case Type::uint32:
      return static_cast<double>(bits);
    case Type::float32:
      return double{std::bit_cast<float>(static_cast<std::uint32_t>(bits))};
    case Type::float64:
      return std::bit_cast<double>(bits);
  }
  return 0;
}

}  // namespace

Values::Values(std::span<const std::uint8_t> bytes, const Words& words, Encoding encoding)
    : bytes_(bytes), words_(words), at_(words.offset()), encoding_(encoding) {}

bool Values::next(Type type, double& value) {
  if (encoding_ == Encoding::ascii) return next_word(value);
  if (!has_room_for(type, 1)) {
    refusal_ = "the file ends within its data";
    return false;
  }
  const std::size_t size = bytes_of(type);
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t byte = encoding_ == Encoding::big_endian ? i : size - 1 - i;
    bits = bits << 8U | bytes_[at_ + byte];
  }
  at_ += size;
  value = number(type, bits);
  return true;
}

bool Values::next_word(double& value) {
  const std::string_view word = words_.word_of_any_line();
  if (parse_number(word, value)) return true;
  refusal_ = word.empty() ? "the file ends within its data" : quoted(word) + " is no number";
  return false;
}

bool Values::skip(Type type, std::uint64_t count) {
  double unused = 0;
  for (std::uint64_t i = 0; i < count; ++i)
    if (!next(type, unused)) return false;
  return true;
}

std::size_t Values::least_bytes(Type type) const {
  return encoding_ == Encoding::ascii ? 2 : bytes_of(type);  // a digit and a blank
}

std::uint64_t Values::bytes_left() const {
  // The last word of a text needs no blank behind it.
  return encoding_ == Encoding::ascii ? bytes_.size() - words_.offset() + 1 : bytes_.size() - at_;
}

bool Values::has_room_for(Type type, std::uint64_t count) const { return count <= bytes_left() / least_bytes(type); }

bool Values::has_room_for(const Element& element) const {
  std::uint64_t row = 0;
  for (const Property& property : element.properties) row += least_bytes(property.count.value_or(property.type));
  return row == 0 || element.count <= bytes_left() / row;
}

std::string Values::place() const {
  return encoding_ == Encoding::ascii ? "line " + std::to_string(words_.line()) : "byte " + std::to_string(at_);
}

}  // namespace tracer::mesh_io::ply
