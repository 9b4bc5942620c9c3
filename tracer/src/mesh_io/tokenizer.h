#pragma once
/// Splits text files into lines and tokens, for mesh formats that are text.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "tracer/src/mesh_io/formats.h"

namespace tracer::mesh_io {

/// Lines end with LF, CRLF or CR and are counted from 1; tokens are separated by blanks and tabs. Returned views point
/// into the bytes, which must outlive them.
class Tokenizer {
 public:
  explicit Tokenizer(Bytes bytes) : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()) {}

  [[nodiscard]] std::size_t line() const { return line_; }
  [[nodiscard]] std::size_t offset() const { return at_; }  ///< bytes before the next token or line end

  /// The next token of this line; empty at its end.
  std::string_view next_token();
  /// The same, with lines joined by a backslash before the line end.
  std::string_view next_token_across_continuations();
  /// The next token of this or a later line; empty at the end of the file.
  std::string_view next_token_on_any_line();
  /// Advances to the next line; false if there is none.
  bool next_line();

 private:
  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
};

/// The nearest double of a decimal number, infinite or 0 beyond their range; nothing for other tokens.
std::optional<double> parse_number(std::string_view word);
/// The same; throws MeshError(`if_missing`) for an empty token, and another sentence for one that is no number.
double number_of(std::string_view word, const char* if_missing);

/// "line 7".
std::string at_line(std::size_t line);

/// The token in double quotes, at most 32 bytes of it, with '?' for control and non-ASCII characters.
std::string in_quotes(std::string_view word);

}  // namespace tracer::mesh_io
