#include "tracer/src/mesh_io/tokenizer.h"

#include <charconv>
#include <limits>
#include <system_error>

namespace tracer::mesh_io {
namespace {

bool is_line_end(char c) { return c == '\n' || c == '\r'; }
bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }

}  // namespace

Tokenizer::Tokenizer(std::span<const std::uint8_t> bytes)
    : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()) {}

std::string_view Tokenizer::next_token() {
  while (at_ < text_.size() && is_blank(text_[at_])) ++at_;
  const std::size_t first = at_;
  while (at_ < text_.size() && !is_blank(text_[at_]) && !is_line_end(text_[at_])) ++at_;
  return text_.substr(first, at_ - first);
}

std::string_view Tokenizer::next_token_across_continuations() {
  for (;;) {
    std::string_view found = next_token();
    const bool joined = found.ends_with('\\') && at_ < text_.size();  // a token ends at a blank or a line end
    if (!joined || !is_line_end(text_[at_])) return found;
    next_line();
    found.remove_suffix(1);
    if (!found.empty()) return found;
  }
}

std::string_view Tokenizer::next_token_on_any_line() {
  for (;;) {
    const std::string_view found = next_token();
    if (!found.empty() || !next_line()) return found;
  }
}

bool Tokenizer::next_line() {
  while (at_ < text_.size() && !is_line_end(text_[at_])) ++at_;
  if (at_ == text_.size()) return false;
  at_ += text_.substr(at_, 2) == "\r\n" ? 2 : 1;
  ++line_;
  return true;
}

bool parse_number(std::string_view word, double& value) {
  if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end != word.data() + word.size() || error == std::errc::invalid_argument) return false;
  if (error == std::errc::result_out_of_range) {  // overflow or underflow
    const bool tiny = word.find("e-") != std::string_view::npos || word.find("E-") != std::string_view::npos;
    value = tiny ? 0 : std::numeric_limits<double>::infinity();
  }
  return true;
}

std::string at_line(std::size_t line, const std::string& sentence) {
  return "line " + std::to_string(line) + ": " + sentence;
}

std::string in_quotes(std::string_view word) {
  constexpr std::size_t length_max = 32;
  std::string text = "\"";
  for (const char c : word.substr(0, length_max)) text += c >= ' ' && c <= '~' ? c : '?';
  return text + (word.size() > length_max ? "...\"" : "\"");
}

}  // namespace tracer::mesh_io
