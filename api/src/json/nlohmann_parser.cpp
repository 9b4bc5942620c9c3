#include "api/src/json/nlohmann_parser.h"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "api/src/json/tape_writer.h"

namespace api::json {
namespace {

using Parser = nlohmann::json;

/// Numbers too large for a double end nlohmann's parser, but are only one mistake among others: each is noted, written
/// over with a zero, and the document parsed again. This often; a document with more of them is refused as a whole.
constexpr std::size_t overflows_max = 16;

/// Listens to nlohmann's parser and writes the tape; stops it at a limit, before memory is spent.
class SaxHandler final : public Parser::json_sax_t {
 public:
  SaxHandler(std::string_view bytes, const DocumentLimits& limits, const std::set<std::size_t>& overflowing)
      : writer(bytes, limits), bytes_(bytes), limits_(limits), overflowing_(overflowing) {}

  bool null() override { return writer.null(); }
  bool boolean(bool value) override { return writer.boolean(value); }
  bool number_integer(std::int64_t value) override { return number(static_cast<double>(value)); }
  bool number_unsigned(std::uint64_t value) override { return number(static_cast<double>(value)); }
  bool number_float(double value, const std::string& text) override {
    if (text.size() > limits_.number_chars) return writer.over("number_chars", limits_.number_chars, text.size());
    return number(value);
  }
  bool string(std::string& value) override { return writer.string(value); }
  bool key(std::string& value) override { return writer.key(value); }
  bool start_object(std::size_t /*unknown*/) override { return writer.open(Kind::object); }
  bool start_array(std::size_t /*unknown*/) override { return writer.open(Kind::array); }
  bool end_object() override { return writer.close(); }
  bool end_array() override { return writer.close(); }
  bool binary(Parser::binary_t& /*never in text*/) override { return false; }

  bool parse_error(std::size_t position, const std::string& token,
                   const nlohmann::detail::exception& failure) override {
    constexpr int number_overflow = 406;
    const std::size_t end = std::min(position, bytes_.size());
    if (failure.id == number_overflow) {
      overflow_at = end - std::min(end, token.size());
      overflow_size = token.size();
    }
    writer.error = {false, end - std::min<std::size_t>(end, position > bytes_.size() ? 0 : 1), failure.what()};
    return false;
  }

  TapeWriter writer;
  std::size_t numbers = 0;
  std::size_t overflow_at = 0, overflow_size = 0;  ///< the number that ended the parse; size 0: none did

 private:
  bool number(double value) {
    return writer.number(overflowing_.contains(numbers++) ? std::numeric_limits<double>::infinity() : value);
  }

  std::string_view bytes_;
  const DocumentLimits& limits_;
  const std::set<std::size_t>& overflowing_;  ///< which numbers, counted from 0, are beyond doubles
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

tracer::Result<Tape, Error> parse_with_nlohmann(std::string_view bytes, const DocumentLimits& limits) {
  if (bytes.starts_with("\xFF\xFE") || bytes.starts_with("\xFE\xFF") || bytes.substr(0, 2).find('\0') != bytes.npos)
    return not_json(0, "the document looks like UTF-16 or UTF-32; it must be UTF-8");
  // The parser would take it for the end.
  if (const std::size_t nul = bytes.find('\0'); nul != bytes.npos) return not_json(nul, "a NUL byte, found byte 0x00");
  std::set<std::size_t> overflowing;
  std::string rewritten;
  for (;;) {
    SaxHandler listener(bytes, limits, overflowing);
    Error& error = listener.writer.error;
    if (Parser::sax_parse(bytes.begin(), bytes.end(), &listener)) return std::move(listener.writer.tape);
    if (listener.overflow_size == 0) {
      if (!error.limit) error.detail = sentence(error.detail, bytes, error.offset);
      return std::move(error);
    }
    if (listener.overflow_size > limits.number_chars) {
      return Error{true, 0,
                   "the limit number_chars is " + std::to_string(limits.number_chars) + ", the document has " +
                       std::to_string(listener.overflow_size)};
    }
    if (overflowing.size() == overflows_max)
      return not_json(listener.overflow_at, "more than " + std::to_string(overflows_max) +
                                                " numbers are too large for a double, found " +
                                                found(bytes, listener.overflow_at));
    overflowing.insert(listener.numbers);
    if (rewritten.empty()) rewritten = bytes;
    rewritten.replace(listener.overflow_at, listener.overflow_size, "0" + std::string(listener.overflow_size - 1, ' '));
    bytes = rewritten;
  }
}

}  // namespace api::json
