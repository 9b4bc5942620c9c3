#include "api/src/json/tape.h"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

namespace api::json {
namespace {

using Parser = nlohmann::json;

/// Numbers too large for a double end nlohmann's parser, but are only one mistake among others: each is noted, written
/// over with a zero, and the document parsed again. This often; a document with more of them is refused as a whole.
constexpr std::size_t overflows_max = 16;

/// Listens to nlohmann's parser and writes the tape; stops it at a limit, before memory is spent.
class Writer final : public Parser::json_sax_t {
 public:
  Writer(std::string_view bytes, const DocumentLimits& limits, const std::set<std::size_t>& overflowing)
      : bytes_(bytes), limits_(limits), overflowing_(overflowing) {
    // A value takes at least a character and a comma or bracket, and no string is longer than its text, so neither is
    // ever outgrown; pages that are not touched cost nothing.
    tape.nodes.reserve(std::min(limits.values, bytes.size() / 2 + limits.depth + 1));
    tape.text.reserve(bytes.size());
  }

  bool null() override { return push(Kind::null) != nullptr; }
  bool boolean(bool value) override {
    Node* const node = push(Kind::boolean);
    if (node != nullptr) node->truth = value;
    return node != nullptr;
  }
  bool number_integer(std::int64_t value) override { return number(static_cast<double>(value)); }
  bool number_unsigned(std::uint64_t value) override { return number(static_cast<double>(value)); }
  bool number_float(double value, const std::string& text) override {
    if (text.size() > limits_.number_chars) return over("number_chars", limits_.number_chars, text.size());
    return number(value);
  }
  bool string(std::string& value) override {
    return text(value, limits_.string_bytes, "string_bytes") && count_element();
  }
  bool key(std::string& value) override {
    ++tape.nodes[open_.back()].size;
    return text(value, limits_.key_bytes, "key_bytes");
  }
  bool start_object(std::size_t /*unknown*/) override { return open(Kind::object); }
  bool start_array(std::size_t /*unknown*/) override { return open(Kind::array); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool binary(Parser::binary_t& /*never in text*/) override { return false; }

  bool parse_error(std::size_t position, const std::string& token,
                   const nlohmann::detail::exception& failure) override {
    constexpr int number_overflow = 406;
    const std::size_t end = std::min(position, bytes_.size());
    if (failure.id == number_overflow) {
      overflow_at = end - std::min(end, token.size());
      overflow_size = token.size();
    }
    error = {false, end - std::min<std::size_t>(end, position > bytes_.size() ? 0 : 1), failure.what()};
    return false;
  }

  Tape tape;
  Error error;
  std::size_t numbers = 0;
  std::size_t overflow_at = 0, overflow_size = 0;  ///< the number that ended the parse; size 0: none did

 private:
  Node* push(Kind kind) {
    if (tape.nodes.size() >= limits_.values) {
      over("values", limits_.values, tape.nodes.size() + 1);
      return nullptr;
    }
    if (kind != Kind::string) count_element();
    Node& node = tape.nodes.emplace_back();
    node.kind = kind;
    return &node;
  }

  /// Objects count their keys instead.
  bool count_element() {
    if (!open_.empty() && tape.nodes[open_.back()].kind == Kind::array) ++tape.nodes[open_.back()].size;
    return true;
  }

  bool number(double value) {
    Node* const node = push(Kind::number);
    if (node == nullptr) return false;
    node->number = overflowing_.contains(numbers) ? std::numeric_limits<double>::infinity() : value;
    ++numbers;
    return true;
  }

  bool text(const std::string& value, std::size_t bytes_max, const char* limit) {
    if (value.size() > bytes_max) return over(limit, bytes_max, value.size());
    Node* const node = push(Kind::string);
    if (node == nullptr) return false;
    node->text = tape.text.data() + tape.text.size();
    node->size = static_cast<std::uint32_t>(value.size());
    tape.text.insert(tape.text.end(), value.begin(), value.end());
    return true;
  }

  bool open(Kind kind) {
    if (open_.size() >= limits_.depth) return over("depth", limits_.depth, open_.size() + 1);
    Node* const node = push(kind);
    if (node == nullptr) return false;
    node->end = 0;
    open_.push_back(static_cast<std::uint32_t>(tape.nodes.size() - 1));
    return true;
  }

  bool close() {
    tape.nodes[open_.back()].end = static_cast<std::uint32_t>(tape.nodes.size());
    open_.pop_back();
    return true;
  }

  bool over(const char* limit, std::size_t bound, std::size_t seen) {
    error = {true, 0,
             std::string("the limit ") + limit + " is " + std::to_string(bound) + ", the document has " +
                 std::to_string(seen)};
    return false;
  }

  std::string_view bytes_;
  const DocumentLimits& limits_;
  const std::set<std::size_t>& overflowing_;  ///< which numbers, counted from 0, are beyond doubles
  std::vector<std::uint32_t> open_;           ///< the arrays and objects around the value, outermost first
};

/// What stands there, for a sentence: the word or number, or the byte where it cannot be shown.
std::string found(std::string_view bytes, std::size_t at) {
  if (at >= bytes.size()) return "the end of the document";
  const auto in_word = [](char c) {
    return c == '-' || c == '+' || c == '.' || c == '_' || (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') ||
           (c >= 'a' && c <= 'z');
  };
  if (bytes[at] <= ' ' || bytes[at] > '~') {
    constexpr std::string_view hex = "0123456789ABCDEF";
    const auto byte = static_cast<unsigned char>(bytes[at]);
    return std::string("byte 0x") + hex[byte >> 4U] + hex[byte & 15U];
  }
  std::size_t size = 1;
  while (in_word(bytes[at]) && size < 24 && at + size < bytes.size() && in_word(bytes[at + size])) ++size;
  return "'" + std::string(bytes.substr(at, size)) + "'";
}

/// nlohmann's message begins with its own name and place and ends with what it read last, which may be no UTF-8; what
/// is between says what it was doing and what it expected.
std::string sentence(std::string_view message, std::string_view bytes, std::size_t at) {
  const std::size_t place = message.find(": ");
  if (place != std::string_view::npos) message.remove_prefix(place + 2);
  message = message.substr(0, message.find("; last read"));
  return std::string(message) + ", found " + found(bytes, at);
}

Error not_json(std::size_t offset, std::string detail) { return {false, offset, std::move(detail)}; }

}  // namespace

tracer::Result<Tape, Error> parse(std::string_view bytes, const DocumentLimits& limits) {
  if (bytes.starts_with("\xFF\xFE") || bytes.starts_with("\xFE\xFF") || bytes.substr(0, 2).find('\0') != bytes.npos)
    return not_json(0, "the document looks like UTF-16 or UTF-32; it must be UTF-8");
  // The parser would take it for the end.
  if (const std::size_t nul = bytes.find('\0'); nul != bytes.npos) return not_json(nul, "a NUL byte, found byte 0x00");
  std::set<std::size_t> overflowing;
  std::string rewritten;
  for (;;) {
    Writer writer(bytes, limits, overflowing);
    if (Parser::sax_parse(bytes.begin(), bytes.end(), &writer)) return std::move(writer.tape);
    if (writer.overflow_size == 0) {
      if (!writer.error.limit) writer.error.detail = sentence(writer.error.detail, bytes, writer.error.offset);
      return std::move(writer.error);
    }
    if (writer.overflow_size > limits.number_chars) {
      return Error{true, 0,
                   "the limit number_chars is " + std::to_string(limits.number_chars) + ", the document has " +
                       std::to_string(writer.overflow_size)};
    }
    if (overflowing.size() == overflows_max)
      return not_json(writer.overflow_at, "more than " + std::to_string(overflows_max) +
                                              " numbers are too large for a double, found " +
                                              found(bytes, writer.overflow_at));
    overflowing.insert(writer.numbers);
    if (rewritten.empty()) rewritten = bytes;
    rewritten.replace(writer.overflow_at, writer.overflow_size, "0" + std::string(writer.overflow_size - 1, ' '));
    bytes = rewritten;
  }
}

}  // namespace api::json
