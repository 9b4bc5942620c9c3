#include "api/src/json/quick_reader.h"

#include <charconv>
#include <nlohmann/json.hpp>
#include <string>

namespace api::json {
namespace {

class QuickReader {
 public:
  QuickReader(std::string_view bytes, const DocumentLimits& limits, TapeWriter& writer)
      : at_(bytes.data()), end_(bytes.data() + bytes.size()), limits_(limits), writer_(writer) {
    if (bytes.starts_with("\xEF\xBB\xBF")) at_ += 3;
  }

  bool document() {
    for (;;) {
      bool begun = false;
      if (!value(begun)) return false;
      if (begun) continue;
      bool another = false;
      while (!another) {
        skip_space();
        if (writer_.outside()) return at_ == end_;
        if (!after_value(another)) return false;
      }
    }
  }

 private:
  /// The next byte; NUL at the end.
  [[nodiscard]] char next() const { return at_ == end_ ? '\0' : *at_; }
  bool take(char wanted) {
    if (next() != wanted) return false;
    ++at_;
    return true;
  }
  void skip_space() {
    while (at_ != end_ && (*at_ == ' ' || *at_ == '\n' || *at_ == '\r' || *at_ == '\t')) ++at_;
  }

  /// `begun`: of an array or object, and its first value comes next.
  bool value(bool& begun) {
    skip_space();
    switch (next()) {
      case '{':
        return open(Kind::object, '}', begun) && (!begun || key());
      case '[':
        return open(Kind::array, ']', begun);
      case '"': {
        std::string_view text;
        return string(text) && writer_.string(text);
      }
      case 't':
        return word("true") && writer_.boolean(true);
      case 'f':
        return word("false") && writer_.boolean(false);
      case 'n':
        return word("null") && writer_.null();
      default:
        return number();
    }
  }

  bool open(Kind kind, char closing, bool& begun) {
    ++at_;
    if (!writer_.open(kind)) return false;
    skip_space();
    begun = !take(closing);
    if (!begun) writer_.close();
    return true;
  }

  /// A comma, and in objects the key behind it; or the end of what the value is in.
  bool after_value(bool& another) {
    const bool in_object = writer_.in_object();
    another = take(',');
    if (another) return !in_object || key();
    if (!take(in_object ? '}' : ']')) return false;
    writer_.close();
    return true;
  }

  bool key() {
    skip_space();
    std::string_view text;
    if (!string(text) || !writer_.key(text)) return false;
    skip_space();
    return take(':');
  }

  bool word(std::string_view wanted) {
    if (!std::string_view(at_, end_).starts_with(wanted)) return false;
    at_ += wanted.size();
    return true;
  }

  /// `text` is valid until the next one. Those with escapes or beyond ASCII are nlohmann's to read.
  bool string(std::string_view& text) {
    const char* const first = at_;
    if (!take('"')) return false;
    bool plain = true;
    while (at_ != end_ && *at_ != '"') {
      const auto byte = static_cast<unsigned char>(*at_);
      if (byte < 0x20) return false;
      plain = plain && byte < 0x80 && byte != '\\';
      if (byte == '\\' && ++at_ == end_) return false;  // what is escaped may be a quote
      ++at_;
    }
    if (!take('"')) return false;
    text = {first + 1, at_ - 1};
    if (plain) return true;
    const auto read = nlohmann::json::parse(first, at_, nullptr, false);
    if (!read.is_string()) return false;
    unescaped_ = read.get_ref<const std::string&>();
    text = unescaped_;
    return true;
  }

  bool digits() {
    const char* const first = at_;
    while (next() >= '0' && next() <= '9') ++at_;
    return at_ != first;
  }

  bool number() {
    const char* const first = at_;
    take('-');
    if (!take('0') && !digits()) return false;
    bool whole = true;
    if (take('.')) {
      whole = false;
      if (!digits()) return false;
    }
    if (next() == 'e' || next() == 'E') {
      whole = false;
      ++at_;
      if (next() == '+' || next() == '-') ++at_;
      if (!digits()) return false;
    }
    double value = 0;
    const auto [end, failure] = std::from_chars(first, at_, value);
    if (failure != std::errc() || end != at_) return false;
    if (static_cast<std::size_t>(at_ - first) > limits_.number_chars) return false;
    return writer_.number(whole && value == 0 ? 0 : value);  // -0 is an integer to nlohmann, and has no sign
  }

  const char* at_;
  const char* const end_;
  const DocumentLimits& limits_;
  TapeWriter& writer_;
  std::string unescaped_;  ///< the last string that was not plain
};

}  // namespace

bool read_quickly(std::string_view bytes, const DocumentLimits& limits, TapeWriter& writer) {
  return QuickReader(bytes, limits, writer).document();
}

}  // namespace api::json
