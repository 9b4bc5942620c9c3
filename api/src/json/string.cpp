#include "api/src/json/string.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace api::json {
namespace {

unsigned byte_at(const char* at) { return static_cast<unsigned char>(*at); }

/// Bytes that end the plain run of a string: quote, backslash, control characters, anything beyond ASCII.
constexpr std::array<bool, 256> special = [] {
  std::array<bool, 256> table{};
  for (std::size_t byte = 0; byte < 256; ++byte)
    table[byte] = byte < 0x20 || byte >= 0x80 || byte == '"' || byte == '\\';
  return table;
}();

/// Length of the well-formed UTF-8 sequence at `at` (RFC 3629, section 4): no overlong forms, no surrogates, nothing
/// above U+10FFFF. 0: malformed.
int utf8_length(const char* at, const char* end) {
  const unsigned lead = byte_at(at);
  const int length = lead < 0xC2 ? 0 : lead < 0xE0 ? 2 : lead < 0xF0 ? 3 : lead < 0xF5 ? 4 : 0;
  if (length == 0 || end - at < length) return 0;
  const unsigned second = byte_at(at + 1);
  const unsigned lowest = lead == 0xE0 ? 0xA0 : lead == 0xF0 ? 0x90 : 0x80;
  const unsigned highest = lead == 0xED ? 0x9F : lead == 0xF4 ? 0x8F : 0xBF;
  if (second < lowest || second > highest) return 0;
  for (int i = 2; i < length; ++i) {
    if ((byte_at(at + i) & 0xC0) != 0x80) return 0;
  }
  return length;
}

/// The four hex digits at `at`, or -1.
std::int32_t hex4(const char* at, const char* end) {
  if (end - at < 4) return -1;
  std::int32_t value = 0;
  for (int i = 0; i < 4; ++i) {
    const char c = at[i];
    const int digit = c >= '0' && c <= '9'   ? c - '0'
                      : c >= 'a' && c <= 'f' ? c - 'a' + 10
                      : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                             : -1;
    if (digit < 0) return -1;
    value = value * 16 + digit;
  }
  return value;
}

void append_utf8(std::int32_t code, std::vector<char>& out) {
  const auto put = [&](std::int32_t byte) { out.push_back(static_cast<char>(byte)); };
  if (code < 0x80) {
    put(code);
  } else if (code < 0x800) {
    put(0xC0 | code >> 6);
    put(0x80 | (code & 0x3F));
  } else if (code < 0x10000) {
    put(0xE0 | code >> 12);
    put(0x80 | (code >> 6 & 0x3F));
    put(0x80 | (code & 0x3F));
  } else {
    put(0xF0 | code >> 18);
    put(0x80 | (code >> 12 & 0x3F));
    put(0x80 | (code >> 6 & 0x3F));
    put(0x80 | (code & 0x3F));
  }
}

/// The escape whose 'u' is at `at`, a surrogate pair included. Moves `at` past it; -1 when malformed.
std::int32_t unicode_escape(const char*& at, const char* end) {
  std::int32_t code = hex4(at + 1, end);
  if (code < 0 || (code >= 0xDC00 && code <= 0xDFFF)) return -1;
  at += 5;
  if (code < 0xD800 || code > 0xDBFF) return code;
  if (end - at < 6 || at[0] != '\\' || at[1] != 'u') return -1;
  const std::int32_t low = hex4(at + 2, end);
  if (low < 0xDC00 || low > 0xDFFF) return -1;
  at += 6;
  return 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
}

/// Undoes the escape whose backslash is at `at` and moves past it; a sentence when it is malformed.
const char* read_escape(const char*& at, const char* end, std::vector<char>& out) {
  constexpr std::string_view letters = "\"\\/bfnrt";
  constexpr std::string_view meanings = "\"\\/\b\f\n\r\t";
  ++at;
  if (at == end) return "the string is not closed";
  if (const std::size_t which = letters.find(*at); which != std::string_view::npos) {
    out.push_back(meanings[which]);
    ++at;
    return nullptr;
  }
  if (*at != 'u') return "unknown escape in a string";
  const std::int32_t code = unicode_escape(at, end);
  if (code < 0) return "\\u must be followed by four hex digits, and surrogates must come in pairs";
  append_utf8(code, out);
  return nullptr;
}

}  // namespace

String read_string(const char* begin, const char* end, std::size_t document_bytes, std::vector<char>& unescaped) {
  const std::size_t start = unescaped.size();
  bool has_escapes = false;
  const char* run = begin + 1;  // what is not yet copied
  const char* at = run;
  for (;;) {
    while (at != end && !special[byte_at(at)]) ++at;
    if (at == end) return {{}, at, "the string is not closed"};
    if (*at == '"') break;
    if (byte_at(at) < 0x20) return {{}, at, "control characters in a string must be escaped"};
    if (*at != '\\') {
      const int length = utf8_length(at, end);
      if (length == 0) return {{}, at, "invalid UTF-8"};
      at += length;
      continue;
    }
    if (unescaped.capacity() == 0) unescaped.reserve(document_bytes);
    has_escapes = true;
    unescaped.insert(unescaped.end(), run, at);
    const char* const escape = at;
    if (const char* error = read_escape(at, end, unescaped)) return {{}, escape, error};
    run = at;
  }
  if (!has_escapes) return {{run, static_cast<std::size_t>(at - run)}, at + 1, nullptr};
  unescaped.insert(unescaped.end(), run, at);
  return {{unescaped.data() + start, unescaped.size() - start}, at + 1, nullptr};
}

}  // namespace api::json
