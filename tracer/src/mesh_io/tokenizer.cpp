#include "tracer/src/mesh_io/tokenizer.h"

#include <charconv>
#include <limits>
#include <system_error>

namespace tracer::mesh_io {
namespace {

bool is_line_end(char c) { return c == '\n' || c == '\r'; }
bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f'; }

}  // namespace

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

std::optional<double> parse_number(std::string_view word) {
  if (word.starts_with('+') && !word.starts_with("+-")) word.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (end != word.data() + word.size() || error == std::errc::invalid_argument) return std::nullopt;
  if (error == std::errc::result_out_of_range) {  // overflow or underflow
    const bool tiny = word.find("e-") != std::string_view::npos || word.find("E-") != std::string_view::npos;
    value = tiny ? 0 : std::numeric_limits<double>::infinity();
  }
  return value;
}

double number_of(std::string_view word, const char* if_missing) {
  const std::optional<double> number = parse_number(word);
  if (!number) throw MeshError(word.empty() ? if_missing : in_quotes(word) + " is no number");
  return *number;
}

std::string at_line(std::size_t line) { return "line " + std::to_string(line); }

std::string in_quotes(std::string_view word) {
  constexpr std::size_t length_max = 32;
  std::string text = "\"";
  for (const char c : word.substr(0, length_max)) text += c >= ' ' && c <= '~' ? c : '?';
  return text + (word.size() > length_max ? "...\"" : "\"");
}

}  // namespace tracer::mesh_io
