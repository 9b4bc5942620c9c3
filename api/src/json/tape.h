#pragma once
/// JSON (RFC 8259) as a flat sequence of nodes in document order: 16 bytes a value, no tree of allocations. simdjson
/// and, where something is wrong, nlohmann-json parse; what they read is written down here instead of in their own
/// trees, which take many times the document's size and cannot be stopped at a limit.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "api/document.h"
#include "tracer/result.h"

namespace api::json {

enum class Kind : std::uint8_t { null, boolean, number, string, array, object };

/// An array is followed by its elements, an object by key (a string), value, key, value, ...
struct Node {
  Kind kind = Kind::null;
  bool used = false;       ///< keys: the reader knows this member
  std::uint32_t size = 0;  ///< strings: bytes; arrays: elements; objects: members
  union {
    double number = 0;  ///< nearest double; infinite where the text overflows, 0 where it underflows
    bool truth;
    const char* text;   ///< into the tape's text
    std::uint32_t end;  ///< arrays, objects: index of the node after the last one inside
  };

  [[nodiscard]] std::string_view string() const { return {text, size}; }
};

/// Moving keeps pointers to nodes and text valid.
struct Tape {
  std::vector<Node> nodes;  ///< the document's value is the first
  std::vector<char> text;   ///< of all strings, escapes undone; never reallocated
  Node* root() { return nodes.data(); }
  Node* next(Node* node) {  ///< the node after `node` and everything inside it
    return node->kind >= Kind::array ? nodes.data() + node->end : node + 1;
  }
};

struct Error {
  bool limit = false;      ///< over a DocumentLimits bound; otherwise not JSON
  std::size_t offset = 0;  ///< byte where it was noticed
  std::string detail;
};

/// Strings come out as valid UTF-8 without lone surrogates; a leading byte order mark is skipped. Duplicate keys are
/// kept: telling them is the reader's part. A number too large for a double is infinite. Time linear in `bytes`; memory
/// at most 16 bytes for each value and key kept plus three for each byte of the document, and 20 MiB.
tracer::Result<Tape, Error> parse(std::string_view bytes, const DocumentLimits& limits);

}  // namespace api::json
