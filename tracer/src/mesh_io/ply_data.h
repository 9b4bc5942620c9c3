#pragma once
/// Header of a PLY file, and its data as a sequence of numbers, for every encoding. Everything throws MeshError.

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "tracer/src/mesh_io/formats.h"

namespace tracer::mesh_io::ply {

/// A type of numbers.
struct Type {
  std::string_view name, alias;  ///< "uchar", "uint8"
  std::size_t bytes;             ///< in binary files
  bool is_integer;
  double (*number)(const std::uint8_t* at, bool swapped);  ///< the value of these bytes
};

template <class T>
double number(const std::uint8_t* at, bool swapped) {
  std::array<std::uint8_t, sizeof(T)> raw;
  std::copy_n(at, sizeof(T), raw.begin());
  if (swapped) std::reverse(raw.begin(), raw.end());
  return static_cast<double>(std::bit_cast<T>(raw));
}

template <class T>
constexpr Type type(std::string_view name, std::string_view alias) {
  return {name, alias, sizeof(T), std::is_integral_v<T>, number<T>};
}

inline constexpr Type types[] = {type<std::int8_t>("char", "int8"),    type<std::uint8_t>("uchar", "uint8"),
                                 type<std::int16_t>("short", "int16"), type<std::uint16_t>("ushort", "uint16"),
                                 type<std::int32_t>("int", "int32"),   type<std::uint32_t>("uint", "uint32"),
                                 type<float>("float", "float32"),      type<double>("double", "float64")};

inline constexpr std::string_view encodings[] = {"ascii", "binary_little_endian", "binary_big_endian"};

inline constexpr std::size_t elements_max = 1000;  // files have two or three; name comparison is quadratic

inline const Type* type_named(std::string_view name) {
  for (const Type& type : types)
    if (name == type.name || name == type.alias) return &type;
  throw MeshError(in_quotes(name) + " is no type");
}

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
  explicit Data(Bytes bytes) : bytes_(bytes), tokens_(bytes) {
    located([&] { return at_line(tokens_.line()); }, [&] { read_header(); });
    tokens_.next_line();
    at_ = tokens_.offset();
  }

  /// In the order of the data; no name twice.
  [[nodiscard]] const std::vector<Element>& elements() const { return elements_; }

  double next(const Type& type) {
    constexpr const char* at_end = "the file ends within its data";
    if (encoding_ == Encoding::ascii) return number_of(tokens_.next_token_on_any_line(), at_end);
    if (type.bytes > bytes_.size() - at_) throw MeshError(at_end);
    constexpr bool little = std::endian::native == std::endian::little;
    const double value = type.number(bytes_.data() + at_, little == (encoding_ == Encoding::binary_big_endian));
    at_ += type.bytes;
    return value;
  }

  void skip(const Type& type, std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) next(type);
  }

  /// True if the rest of the file can contain `count` values. Checked before allocation.
  [[nodiscard]] bool has_room_for(const Type& type, std::uint64_t count) const {
    return count <= bytes_left() / least_bytes(type);
  }

  /// The same for all rows of an element, with empty lists.
  [[nodiscard]] bool has_room_for(const Element& element) const {
    std::uint64_t row = 0;
    for (const Property& property : element.properties)
      row += least_bytes(property.count != nullptr ? *property.count : *property.type);
    return row == 0 || element.count <= bytes_left() / row;
  }

  /// Position of the next value: "line 7" or "byte 129".
  [[nodiscard]] std::string place() const {
    return encoding_ == Encoding::ascii ? at_line(tokens_.line()) : "byte " + std::to_string(at_);
  }

 private:
  enum class Encoding : std::uint8_t { ascii, binary_little_endian, binary_big_endian };

  /// The first line contains the keyword "ply" only.
  void read_header() {
    while (tokens_.next_line()) {
      const std::string_view keyword = tokens_.next_token();
      if (keyword == "end_header") {
        if (!encoding_) throw MeshError("the header has no format");
        for (const Element& element : elements_)
          if (element.properties.empty() && element.count > 0)
            throw MeshError("the element " + in_quotes(element.name) + " has no properties");
        return;
      }
      if (keyword == "format") {
        read_format();
      } else if (keyword == "element") {
        read_element();
      } else if (keyword == "property") {
        read_property();
      } else if (keyword != "comment" && keyword != "obj_info" && !keyword.empty()) {
        throw MeshError(in_quotes(keyword) + " has no place in a header");
      }
    }
    throw MeshError("the file ends within its header");
  }

  void read_format() {
    const std::string_view name = tokens_.next_token();
    const auto* found = std::find(std::begin(encodings), std::end(encodings), name);
    if (found == std::end(encodings))
      throw MeshError("the format must be ascii, binary_little_endian or binary_big_endian, got " + in_quotes(name));
    encoding_ = static_cast<Encoding>(found - std::begin(encodings));
  }

  void read_element() {
    Element element;
    element.name = tokens_.next_token();
    const std::string_view count = tokens_.next_token();
    const auto [end, error] = std::from_chars(count.data(), count.data() + count.size(), element.count);
    if (error != std::errc() || end != count.data() + count.size())
      throw MeshError("must be the number of the elements " + in_quotes(element.name) + ", got " + in_quotes(count));
    const auto same = [&](const Element& other) { return other.name == element.name; };
    if (std::any_of(elements_.begin(), elements_.end(), same))
      throw MeshError("the element " + in_quotes(element.name) + " is declared twice");
    if (elements_.size() == elements_max) throw MeshError("the limit elements_max is " + std::to_string(elements_max));
    elements_.push_back(std::move(element));
  }

  void read_property() {
    if (elements_.empty()) throw MeshError("a property must follow its element");
    Property property;
    std::string_view type = tokens_.next_token();
    if (type == "list") {
      property.count = type_named(tokens_.next_token());
      if (!property.count->is_integer) throw MeshError("the length of a list must be an integer");
      type = tokens_.next_token();
    }
    property.type = type_named(type);
    property.name = tokens_.next_token();
    elements_.back().properties.push_back(std::move(property));
  }

  /// Minimum number of bytes of a value in the file: a digit and a blank, or its binary size.
  [[nodiscard]] std::size_t least_bytes(const Type& type) const {
    return encoding_ == Encoding::ascii ? 2 : type.bytes;
  }
  [[nodiscard]] std::uint64_t bytes_left() const {
    // The last token of a text needs no separator after it.
    return encoding_ == Encoding::ascii ? bytes_.size() - tokens_.offset() + 1 : bytes_.size() - at_;
  }

  Bytes bytes_;
  Tokenizer tokens_;    ///< header, and data in ASCII
  std::size_t at_ = 0;  ///< binary data: first byte of the next value
  std::optional<Encoding> encoding_;
  std::vector<Element> elements_;
};

}  // namespace tracer::mesh_io::ply
