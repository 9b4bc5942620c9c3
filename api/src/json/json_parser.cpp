#include "api/reader/json_parser.h"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

namespace api::json {
namespace {

using Parser = nlohmann::ordered_json;

/// nlohmann's parser stops at a number too large for a double, which is only one issue among others: each such number
/// is replaced by a zero and the document parsed again, at most this often.
constexpr std::size_t overflows_max = 16;

std::string over_limit(const char* limit, std::size_t bound, std::size_t seen) {
  return std::string("the limit ") + limit + " is " + std::to_string(bound) + ", the document has " +
         std::to_string(seen);
}

/// Builds the tape from the parser's events. An event that returns false stops the parser; `error` has the reason.
class TapeBuilder final : public Parser::json_sax_t {
 public:
  TapeBuilder(std::string_view bytes, const DocumentLimits& limits, const std::set<std::size_t>& overflowing)
      : bytes_(bytes), limits_(limits), overflowing_(overflowing) {
    // A value takes at least two characters with its separator, and no string is longer than its text, so neither
    // vector is reallocated. Pages that are not touched cost nothing.
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
    return within("number_chars", limits_.number_chars, text.size()) && number(value);
  }
  bool string(std::string& value) override {
    if (!text(value, "string_bytes", limits_.string_bytes)) return false;
    count_element();
    return true;
  }
  bool key(std::string& value) override {
    ++tape.nodes[open_.back()].size;
    return text(value, "key_bytes", limits_.key_bytes);
  }
  bool start_object(std::size_t /*size*/) override { return open(Kind::object); }
  bool start_array(std::size_t /*size*/) override { return open(Kind::array); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool binary(Parser::binary_t& /*value*/) override { return false; }  // does not occur in text

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
  std::size_t overflow_at = 0, overflow_size = 0;  ///< the overflowing number that ended the parse; size 0: none

 private:
  bool within(const char* limit, std::size_t bound, std::size_t seen) {
    if (seen > bound) error = {true, 0, over_limit(limit, bound, seen)};
    return seen <= bound;
  }

  Node* push(Kind kind) {
    if (!within("values", limits_.values, tape.nodes.size() + 1)) return nullptr;
    if (kind != Kind::string) count_element();
    Node& node = tape.nodes.emplace_back();
    node.kind = kind;
    return &node;
  }

  /// Objects count their keys instead.
  void count_element() {
    if (!open_.empty() && tape.nodes[open_.back()].kind == Kind::array) ++tape.nodes[open_.back()].size;
  }

  bool number(double value) {
    Node* const node = push(Kind::number);
    if (node != nullptr)
      node->number = overflowing_.contains(numbers) ? std::numeric_limits<double>::infinity() : value;
    ++numbers;
    return node != nullptr;
  }

  bool text(std::string_view value, const char* limit, std::size_t bytes_max) {
    Node* const node = within(limit, bytes_max, value.size()) ? push(Kind::string) : nullptr;
    if (node == nullptr) return false;
    node->text = tape.text.data() + tape.text.size();
    node->size = static_cast<std::uint32_t>(value.size());
    tape.text.insert(tape.text.end(), value.begin(), value.end());
    return true;
  }

  bool open(Kind kind) {
    Node* const node = within("depth", limits_.depth, open_.size() + 1) ? push(kind) : nullptr;
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

  std::string_view bytes_;
  const DocumentLimits& limits_;
  const std::set<std::size_t>& overflowing_;  ///< indices of the numbers too large for a double
  std::vector<std::uint32_t> open_;           ///< the arrays and objects around the value, outermost first
};

/// The word, number or character at `at`, quoted for an error message; in hexadecimal if it is not printable.
std::string found(std::string_view bytes, std::size_t at) {
  constexpr std::string_view hex = "0123456789ABCDEF";
  constexpr std::string_view word = "-+._0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz";
  if (at >= bytes.size()) return "the end of the document";
  const auto byte = static_cast<unsigned char>(bytes[at]);
  if (byte <= ' ' || byte > '~') return std::string("byte 0x") + hex[byte >> 4U] + hex[byte & 15U];
  const std::string_view text = bytes.substr(at, 24);
  const std::size_t size = std::max<std::size_t>(1, std::min(text.find_first_not_of(word), text.size()));
  return "'" + std::string(text.substr(0, size)) + "'";
}

/// Advice about habits from other languages; empty without any.
std::string_view advice(std::string_view message, std::string_view bytes, std::size_t at) {
  const std::string_view rest = bytes.substr(std::min(at, bytes.size()));
  const std::size_t before = bytes.substr(0, at).find_last_not_of(" \t\r\n");
  const bool after_comma = before != std::string_view::npos && bytes[before] == ',';
  const char c = rest.empty() ? '\0' : rest[0];
  const auto mentions = [&](std::string_view text) { return message.find(text) != std::string_view::npos; };
  if (after_comma && c == '}') return ": a comma before }, which the last member must not have";
  if (after_comma && c == ']') return ": a comma before ], which the last element must not have";
  if (c == '/' || c == '#') return ": JSON has no comments";
  if (c == '\'') return ": write text in double quotes";
  if (mentions("object key") && c > ' ') return ": write names in double quotes";
  if (!rest.empty() && (mentions("expected '}'") || mentions("expected ']'"))) return ": is a comma missing before it?";
  return {};
}

/// nlohmann's message without its prefix (library and position) and its suffix (the text read last, which may not be
/// UTF-8), with advice.
std::string sentence(std::string_view message, std::string_view bytes, std::size_t at) {
  const std::size_t place = message.find(": ");
  if (place != std::string_view::npos) message.remove_prefix(place + 2);
  message = message.substr(0, message.find("; last read"));
  return std::string(message) + ", found " + found(bytes, at) + std::string(advice(message, bytes, at));
}

/// The reason to refuse the first string or number that is over its limit whatever its escapes are; empty if there is
/// none before the end or the first error. The parser would read it completely before it reports its size, which takes
/// seconds if the document is longer than a string may be.
std::string oversized_token(std::string_view bytes, const DocumentLimits& limits) {
  constexpr std::string_view number = "0123456789+-.eE";
  const std::size_t string_bytes = std::max(limits.string_bytes, limits.key_bytes);
  if (bytes.size() <= string_bytes) return {};
  for (std::size_t at = 0; at < bytes.size();) {
    const char c = bytes[at];
    if (c == '"') {
      std::size_t size = 0;  // at least, in bytes
      for (++at; at < bytes.size() && bytes[at] != '"'; ++size) {
        if (static_cast<unsigned char>(bytes[at]) < ' ') return {};
        at += bytes[at] != '\\' ? 1 : at + 1 < bytes.size() && bytes[at + 1] == 'u' ? 6 : 2;
      }
      if (size > string_bytes) return over_limit("string_bytes", limits.string_bytes, size);
      ++at;
    } else if (c == '-' || (c >= '0' && c <= '9')) {
      const std::size_t end = std::min(bytes.find_first_not_of(number, at), bytes.size());
      if (end - at > limits.number_chars) return over_limit("number_chars", limits.number_chars, end - at);
      at = end;
    } else {
      ++at;
    }
  }
  return {};
}

}  // namespace

tracer::Result<Tape, Error> parse(std::string_view bytes, const DocumentLimits& limits) {
  if (bytes.starts_with("\xFF\xFE") || bytes.starts_with("\xFE\xFF") || bytes.substr(0, 2).find('\0') != bytes.npos)
    return Error{false, 0, "the document looks like UTF-16 or UTF-32; it must be UTF-8"};
  // The parser would take it for the end.
  if (const std::size_t nul = bytes.find('\0'); nul != bytes.npos)
    return Error{false, nul, "a NUL byte, found byte 0x00"};
  if (std::string detail = oversized_token(bytes, limits); !detail.empty()) return Error{true, 0, std::move(detail)};
  std::set<std::size_t> overflowing;
  std::string rewritten;
  for (;;) {
    TapeBuilder builder(bytes, limits, overflowing);
    if (Parser::sax_parse(bytes.begin(), bytes.end(), &builder)) return std::move(builder.tape);
    Error& error = builder.error;
    const std::size_t at = builder.overflow_at, size = builder.overflow_size;
    if (size == 0) {
      if (!error.limit) error.detail = sentence(error.detail, bytes, error.offset);
      return std::move(error);
    }
    if (size > limits.number_chars) return Error{true, 0, over_limit("number_chars", limits.number_chars, size)};
    if (overflowing.size() == overflows_max)
      return Error{false, at,
                   "more than " + std::to_string(overflows_max) + " numbers are too large for a double, found " +
                       found(bytes, at)};
    overflowing.insert(builder.numbers);
    if (rewritten.empty()) rewritten = bytes;
    rewritten.replace(at, size, "0" + std::string(size - 1, ' '));
    bytes = rewritten;
  }
}

}  // namespace api::json
