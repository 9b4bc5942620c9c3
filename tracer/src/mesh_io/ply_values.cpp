#include "tracer/src/mesh_io/ply_values.h"

#include <algorithm>
#include <array>
#include <bit>

namespace tracer::mesh_io::ply {
namespace {

/// Reads a value of type T from its bytes.
template <class T>
double number(const std::uint8_t* at, bool swapped) {
  std::array<std::uint8_t, sizeof(T)> raw;
  std::copy_n(at, sizeof(T), raw.begin());
  if (swapped) std::reverse(raw.begin(), raw.end());
  return static_cast<double>(std::bit_cast<T>(raw));
}

double number(Type type, const std::uint8_t* at, bool swapped) {
  switch (type) {
    case Type::int8:
      return number<std::int8_t>(at, swapped);
    case Type::int16:
      return number<std::int16_t>(at, swapped);
    case Type::int32:
      return number<std::int32_t>(at, swapped);
    case Type::uint8:
      return number<std::uint8_t>(at, swapped);
    case Type::uint16:
      return number<std::uint16_t>(at, swapped);
    case Type::uint32:
      return number<std::uint32_t>(at, swapped);
    case Type::float32:
      return number<float>(at, swapped);
    case Type::float64:
      return number<double>(at, swapped);
  }
  return 0;
}

}  // namespace

Values::Values(std::span<const std::uint8_t> bytes, const Tokenizer& tokens, Encoding encoding)
    : bytes_(bytes), tokens_(tokens), at_(tokens.offset()), encoding_(encoding) {}

bool Values::next(Type type, double& value) {
  if (encoding_ == Encoding::ascii) return next_token(value);
  const std::size_t size = bytes_of(type);
  if (size > bytes_.size() - at_) {
    error_ = "the file ends within its data";
    return false;
  }
  constexpr bool little = std::endian::native == std::endian::little;
  value = number(type, bytes_.data() + at_, little == (encoding_ == Encoding::big_endian));
  at_ += size;
  return true;
}

bool Values::next_token(double& value) {
  const std::string_view word = tokens_.next_token_on_any_line();
  if (parse_number(word, value)) return true;
  error_ = word.empty() ? "the file ends within its data" : in_quotes(word) + " is no number";
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
  // The last token of a text needs no separator after it.
  return encoding_ == Encoding::ascii ? bytes_.size() - tokens_.offset() + 1 : bytes_.size() - at_;
}

bool Values::has_room_for(Type type, std::uint64_t count) const { return count <= bytes_left() / least_bytes(type); }

bool Values::has_room_for(const Element& element) const {
  std::uint64_t row = 0;
  for (const Property& property : element.properties) row += least_bytes(property.count.value_or(property.type));
  return row == 0 || element.count <= bytes_left() / row;
}

std::string Values::place() const {
  return encoding_ == Encoding::ascii ? "line " + std::to_string(tokens_.line()) : "byte " + std::to_string(at_);
}

}  // namespace tracer::mesh_io::ply
