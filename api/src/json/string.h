#pragma once
/// JSON strings: escapes undone, UTF-8 (RFC 3629) checked.

#include <string_view>
#include <vector>

namespace api::json {

struct String {
  std::string_view value;     ///< into the document, or into `unescaped` where there were escapes
  const char* end = nullptr;  ///< after the closing quote; where it went wrong when `error` is set
  const char* error = nullptr;
};

/// Reads the string whose opening quote is at `begin`. `unescaped` is appended to within its capacity, which must be at
/// least the document's size (an escape is never shorter than what it stands for); it is reserved here at first use.
String read_string(const char* begin, const char* end, std::size_t document_bytes, std::vector<char>& unescaped);

}  // namespace api::json
