#include "tracer/src/mesh_io/ply_header.h"

#include <algorithm>
#include <charconv>
#include <utility>

namespace tracer::mesh_io::ply {
namespace {

struct TypeName {
  std::string_view name;
  Type type;
};

constexpr TypeName type_names[] = {
    {"char", Type::int8},     {"int8", Type::int8},       {"uchar", Type::uint8},    {"uint8", Type::uint8},
    {"short", Type::int16},   {"int16", Type::int16},     {"ushort", Type::uint16},  {"uint16", Type::uint16},
    {"int", Type::int32},     {"int32", Type::int32},     {"uint", Type::uint32},    {"uint32", Type::uint32},
    {"float", Type::float32}, {"float32", Type::float32}, {"double", Type::float64}, {"float64", Type::float64}};

struct EncodingName {
  std::string_view name;
  Encoding encoding;
};

constexpr EncodingName encoding_names[] = {{"ascii", Encoding::ascii},
                                           {"binary_little_endian", Encoding::little_endian},
                                           {"binary_big_endian", Encoding::big_endian}};

class HeaderReader {
 public:
  explicit HeaderReader(Tokenizer& tokens) : tokens_(tokens) {}

  Result<Header, std::string> read() {
    while (tokens_.next_line()) {
      const std::size_t line = tokens_.line();
      const std::string_view keyword = tokens_.next_token();
      if (keyword == "end_header") return finish(line);
      if (!read_line(keyword)) return at_line(line, error_);
    }
    return at_line(tokens_.line(), "the file ends within its header");
  }

 private:
  bool fail(std::string sentence) {
    error_ = std::move(sentence);
    return false;
  }

  Result<Header, std::string> finish(std::size_t line) {
    if (!has_format_) return at_line(line, "the header has no format");
    for (const Element& element : header_.elements)
      if (element.properties.empty() && element.count > 0)
        return at_line(line, "the element " + in_quotes(element.name) + " has no properties");
    tokens_.next_line();
    return std::move(header_);
  }

  bool read_line(std::string_view keyword) {
    if (keyword == "comment" || keyword == "obj_info" || keyword.empty()) return true;
    if (keyword == "format") return read_format();
    if (keyword == "element") return read_element();
    if (keyword == "property") return read_property();
    return fail(in_quotes(keyword) + " has no place in a header");
  }

  bool read_format() {
    const std::string_view name = tokens_.next_token();
    for (const auto& [known, encoding] : encoding_names) {
      if (name != known) continue;
      header_.encoding = encoding;
      has_format_ = true;
      return true;
    }
    return fail("the format must be ascii, binary_little_endian or binary_big_endian, got " + in_quotes(name));
  }

  bool read_element() {
    Element element;
    element.name = tokens_.next_token();
    const std::string_view count = tokens_.next_token();
    const auto [end, error] = std::from_chars(count.data(), count.data() + count.size(), element.count);
    if (error != std::errc() || end != count.data() + count.size())
      return fail("must be the number of the elements " + in_quotes(element.name) + ", got " + in_quotes(count));
    const auto same = [&](const Element& other) { return other.name == element.name; };
    if (std::any_of(header_.elements.begin(), header_.elements.end(), same))
      return fail("the element " + in_quotes(element.name) + " is declared twice");
    if (header_.elements.size() == elements_max)
      return fail("the limit elements_max is " + std::to_string(elements_max));
    header_.elements.push_back(std::move(element));
    return true;
  }

  bool read_type(Type& type) {
    const std::string_view name = tokens_.next_token();
    for (const auto& [known, meaning] : type_names) {
      if (name != known) continue;
      type = meaning;
      return true;
    }
    return fail(in_quotes(name) + " is no type");
  }

  bool read_property() {
    if (header_.elements.empty()) return fail("a property must follow its element");
    Property property;
    Tokenizer ahead = tokens_;
    if (ahead.next_token() == "list") {
      tokens_ = ahead;
      if (!read_type(property.count.emplace())) return false;
      if (*property.count >= Type::float32) return fail("the length of a list must be an integer");
    }
    if (!read_type(property.type)) return false;
    property.name = tokens_.next_token();
    header_.elements.back().properties.push_back(std::move(property));
    return true;
  }

  static constexpr std::size_t elements_max = 1000;  // files have two or three; name comparison is quadratic

  Tokenizer& tokens_;
  Header header_;
  bool has_format_ = false;
  std::string error_;
};

}  // namespace

Result<Header, std::string> read_header(Tokenizer& tokens) { return HeaderReader(tokens).read(); }

}  // namespace tracer::mesh_io::ply
