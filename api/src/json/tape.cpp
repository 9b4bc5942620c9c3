#include "api/src/json/tape.h"

#include <algorithm>
#include <utility>

#include "api/src/json/number.h"
#include "api/src/json/string.h"

namespace api::json {
namespace {

class Parser {
 public:
  Parser(std::string_view bytes, const DocumentLimits& limits)
      : begin_(bytes.data()), at_(bytes.data()), end_(bytes.data() + bytes.size()), limits_(limits) {
    // A value takes at least a character and a comma or bracket, so this is never outgrown; pages that are not
    // touched cost nothing.
    tape_.nodes.reserve(std::min(limits.values, bytes.size() / 2 + limits.depth + 1));
  }

  tracer::Result<Tape, Error> run() {
    if (document()) return std::move(tape_);
    return std::move(error_);
  }

 private:
  bool document();
  bool step();
  bool value();
  bool open(Kind kind);
  bool string(std::size_t bytes_max, const char* limit_name);
  bool number();
  bool literal(std::string_view word, Kind kind, bool truth);

  Node* push(Kind kind);
  bool fail(std::string detail);
  bool over(const char* limit, std::size_t bound, const std::string& seen);
  [[nodiscard]] std::string found() const;
  void skip_space() {
    while (at_ != end_ && (*at_ == ' ' || *at_ == '\n' || *at_ == '\r' || *at_ == '\t')) ++at_;
  }
  [[nodiscard]] bool sees(char c) const { return at_ != end_ && *at_ == c; }

  const char* const begin_;
  const char* at_;
  const char* const end_;
  const DocumentLimits& limits_;
  std::vector<std::uint32_t> open_;  ///< the arrays and objects around `at_`, outermost first
  Tape tape_;
  Error error_;
};

bool Parser::document() {
  const std::string_view bytes(begin_, static_cast<std::size_t>(end_ - begin_));
  if (bytes.starts_with("\xEF\xBB\xBF")) at_ += 3;
  if (bytes.starts_with("\xFF\xFE") || bytes.starts_with("\xFE\xFF") || bytes.substr(0, 2).find('\0') != bytes.npos) {
    return fail("the document looks like UTF-16 or UTF-32; it must be UTF-8");
  }
  skip_space();
  if (at_ == end_) return fail("the document is empty");
  if (!value()) return false;
  while (!open_.empty()) {
    if (!step()) return false;
  }
  skip_space();
  return at_ == end_ || fail("expected the end of the document after its value, found " + found());
}

/// Within the innermost open array or object: closes it, or reads its next element or member.
bool Parser::step() {
  Node& container = tape_.nodes[open_.back()];
  const bool is_object = container.kind == Kind::object;
  const char closer = is_object ? '}' : ']';
  skip_space();
  if (sees(closer)) {
    ++at_;
    container.end = static_cast<std::uint32_t>(tape_.nodes.size());
    open_.pop_back();
    return true;
  }
  if (container.size > 0) {
    if (!sees(',')) return fail(std::string("expected ',' or '") + closer + "', found " + found());
    ++at_;
    skip_space();
  }
  ++container.size;
  if (is_object) {
    if (!sees('"')) return fail("expected a key in double quotes, found " + found());
    if (!string(limits_.key_bytes, "key_bytes")) return false;
    skip_space();
    if (!sees(':')) return fail("expected ':' after the key, found " + found());
    ++at_;
    skip_space();
  }
  return value();
}

bool Parser::value() {
  if (tape_.nodes.size() >= limits_.values) return over("values", limits_.values, "more");
  switch (at_ == end_ ? '\0' : *at_) {
    case '{':
      return open(Kind::object);
    case '[':
      return open(Kind::array);
    case '"':
      return string(limits_.string_bytes, "string_bytes");
    case 't':
      return literal("true", Kind::boolean, true);
    case 'f':
      return literal("false", Kind::boolean, false);
    case 'n':
      return literal("null", Kind::null, false);
    default:
      return number();
  }
}

bool Parser::open(Kind kind) {
  if (open_.size() >= limits_.depth) return over("depth", limits_.depth, "more");
  open_.push_back(static_cast<std::uint32_t>(tape_.nodes.size()));
  push(kind)->end = 0;
  ++at_;
  return true;
}

bool Parser::string(std::size_t bytes_max, const char* limit_name) {
  if (tape_.nodes.size() >= limits_.values) return over("values", limits_.values, "more");
  const String read = read_string(at_, end_, static_cast<std::size_t>(end_ - begin_), tape_.unescaped);
  if (read.error != nullptr) {
    at_ = read.end;
    return fail(read.error);
  }
  if (read.value.size() > bytes_max) return over(limit_name, bytes_max, std::to_string(read.value.size()));
  Node* const node = push(Kind::string);
  node->text = read.value.data();
  node->size = static_cast<std::uint32_t>(read.value.size());
  at_ = read.end;
  return true;
}

bool Parser::number() {
  const Number read = read_number(at_, end_);
  if (read.end == nullptr) return fail("expected a value, found " + found());
  const auto chars = static_cast<std::size_t>(read.end - at_);
  if (chars > limits_.number_chars) return over("number_chars", limits_.number_chars, std::to_string(chars));
  push(Kind::number)->number = read.value;
  at_ = read.end;
  return true;
}

bool Parser::literal(std::string_view word, Kind kind, bool truth) {
  if (!std::string_view(at_, static_cast<std::size_t>(end_ - at_)).starts_with(word)) {
    return fail("expected a value, found " + found());
  }
  push(kind)->truth = truth;
  at_ += word.size();
  return true;
}

Node* Parser::push(Kind kind) {
  Node& node = tape_.nodes.emplace_back();
  node.kind = kind;
  return &node;
}

bool Parser::fail(std::string detail) {
  error_ = {false, static_cast<std::size_t>(at_ - begin_), std::move(detail)};
  return false;
}

bool Parser::over(const char* limit, std::size_t bound, const std::string& seen) {
  error_ = {true, static_cast<std::size_t>(at_ - begin_),
            std::string("the limit ") + limit + " is " + std::to_string(bound) + ", the document has " + seen};
  return false;
}

/// What stands at `at_`, for a sentence: the word or number there, or the byte where it cannot be shown.
std::string Parser::found() const {
  if (at_ == end_) return "the end of the document";
  const auto shown = [](char c) { return c > ' ' && c <= '~'; };
  const auto in_word = [](char c) {
    return c == '-' || c == '+' || c == '.' || c == '_' || (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') ||
           (c >= 'a' && c <= 'z');
  };
  if (!shown(*at_)) {
    constexpr std::string_view hex = "0123456789ABCDEF";
    const auto byte = static_cast<unsigned char>(*at_);
    return std::string("byte 0x") + hex[byte >> 4] + hex[byte & 15];
  }
  const char* stop = at_ + 1;
  if (in_word(*at_)) {
    while (stop != end_ && stop - at_ < 24 && in_word(*stop)) ++stop;
  }
  return std::string("'").append(at_, stop).append("'");
}

}  // namespace

tracer::Result<Tape, Error> parse(std::string_view bytes, const DocumentLimits& limits) {
  return Parser(bytes, limits).run();
}

}  // namespace api::json
