#pragma once
/// Parses JSON text (RFC 8259) with limits, by the SAX interface of nlohmann-json, to a flat sequence of nodes in
/// document order: 16 bytes a value instead of a tree of allocations, which takes many times the document's size and
/// cannot be stopped at a limit.

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
  bool used = false;       ///< keys: the reader has taken this member
  std::uint32_t size = 0;  ///< strings: bytes; arrays: elements; objects: members
  union {
    double number = 0;  ///< nearest double; infinite if the text overflows, 0 if it underflows
    bool truth;
    const char* text;   ///< in the tape's text
    std::uint32_t end;  ///< arrays, objects: index of the node after the last one inside
  };

  [[nodiscard]] std::string_view string() const { return {text, size}; }
};

/// Moving keeps pointers to nodes and text valid.
struct Tape {
  std::vector<Node> nodes;  ///< the first one is the document's value
  std::vector<char> text;   ///< contents of all strings without escapes; never reallocated
  Node* root() { return nodes.data(); }
  Node* next(Node* node) {  ///< the node after `node` and everything inside it
    return node->kind >= Kind::array ? nodes.data() + node->end : node + 1;
  }
  /// The first key of that name in an object; null if there is none or `object` is no object. Its value follows it.
  Node* find_key(Node* object, std::string_view name) {
    if (object->kind != Kind::object) return nullptr;
    Node* key = object + 1;
    for (std::uint32_t i = 0; i < object->size; ++i, key = next(key + 1))
      if (key->string() == name) return key;
    return nullptr;
  }
};

struct Error {
  bool limit = false;      ///< a DocumentLimits bound is exceeded; otherwise the text is not JSON
  std::size_t offset = 0;  ///< byte at which the error was found
  std::string detail;
};

/// Strings are valid UTF-8 without lone surrogates; a leading byte order mark is skipped. Duplicate keys are kept for
/// the reader to report. A number too large for a double is infinite; more than 16 of them are an error. Time is
/// linear in `bytes`; memory is at most 16 bytes for each value and key kept plus three for each byte of the document.
tracer::Result<Tape, Error> parse(std::string_view bytes, const DocumentLimits& limits);

}  // namespace api::json
