#pragma once
/// Walks through a text file by lines and words, for mesh formats that are text.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace tracer::mesh_io {

/// Lines end with LF, CRLF or CR and are counted from 1; words are parted by blanks and tabs. Views point into the
/// bytes.
class Words {
 public:
  explicit Words(std::span<const std::uint8_t> bytes);

  [[nodiscard]] std::size_t line() const { return line_; }
  [[nodiscard]] std::size_t offset() const { return at_; }  ///< bytes before the next word or line end
  [[nodiscard]] bool at_end() const { return at_ == text_.size(); }

  /// The next word of this line; empty at its end.
  std::string_view word();
  /// The same, where a backslash before the line's end joins the next line to it.
  std::string_view next_token_across_continuations();
  /// The next word on whatever line; empty at the end of the file.
  std::string_view word_of_any_line();
  /// To the next line's beginning; false when there is none.
  bool next_line();

 private:
  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
};

/// A decimal number: the nearest double, infinite or 0 beyond their range. False when the word is anything else.
bool parse_number(std::string_view word, double& value);

/// "line 7: what is wrong"
std::string at_line(std::size_t line, const std::string& sentence);

/// In double quotes, at most 32 bytes of it, control and other than ASCII characters as '?': fit for any terminal.
std::string in_quotes(std::string_view word);

}  // namespace tracer::mesh_io
