#pragma once
/// JSON numbers: the grammar of RFC 8259 and its nearest double.

#include <cstddef>

namespace api::json {

struct Number {
  double value = 0;           ///< infinite where the text overflows, 0 where it underflows
  const char* end = nullptr;  ///< after the last character; null: not a number
};

/// Reads the number that begins at `begin`. Correctly rounded, whatever the locale.
Number read_number(const char* begin, const char* end);

}  // namespace api::json
