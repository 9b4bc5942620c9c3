#pragma once
/// What parsers tell of a document, value by value, becomes a tape; stopped at a limit, before memory is spent.

#include <algorithm>
#include <string>
#include <vector>

#include "api/src/json/tape.h"

namespace api::json {

/// Each false: over a limit, which `error` tells.
class TapeWriter {
 public:
  TapeWriter(std::string_view bytes, const DocumentLimits& limits) : limits_(limits) {
    // A value takes at least a character and a comma or bracket, and no string is longer than its text, so neither is
    // ever outgrown; pages that are not touched cost nothing.
    tape.nodes.reserve(std::min(limits.values, bytes.size() / 2 + limits.depth + 1));
    tape.text.reserve(bytes.size());
  }

  bool null() { return push(Kind::null) != nullptr; }
  bool boolean(bool value) {
    Node* const node = push(Kind::boolean);
    if (node != nullptr) node->truth = value;
    return node != nullptr;
  }
  bool number(double value) {
    Node* const node = push(Kind::number);
    if (node != nullptr) node->number = value;
    return node != nullptr;
  }
  bool string(std::string_view value) {
    if (!text(value, limits_.string_bytes, "string_bytes")) return false;
    count_element();
    return true;
  }
  bool key(std::string_view value) {
    ++tape.nodes[open_.back()].size;
    return text(value, limits_.key_bytes, "key_bytes");
  }
  bool open(Kind kind) {
    if (open_.size() >= limits_.depth) return over("depth", limits_.depth, open_.size() + 1);
    Node* const node = push(kind);
    if (node == nullptr) return false;
    node->end = 0;
    open_.push_back(static_cast<std::uint32_t>(tape.nodes.size() - 1));
    return true;
  }
  bool close() {
    tape.nodes[open_.back()].end = static_cast<std::uint32_t>(tape.nodes.size());
    open_.pop_back();
    return true;
  }

  bool over(const char* limit, std::size_t bound, std::size_t seen) {
    error = {true, 0,
             std::string("the limit ") + limit + " is " + std::to_string(bound) + ", the document has " +
                 std::to_string(seen)};
    return false;
  }

  Tape tape;
  Error error;

 private:
  Node* push(Kind kind) {
    if (tape.nodes.size() >= limits_.values) {
      over("values", limits_.values, tape.nodes.size() + 1);
      return nullptr;
    }
    if (kind != Kind::string) count_element();
    Node& node = tape.nodes.emplace_back();
    node.kind = kind;
    return &node;
  }

  /// Objects count their keys instead.
  void count_element() {
    if (!open_.empty() && tape.nodes[open_.back()].kind == Kind::array) ++tape.nodes[open_.back()].size;
  }

  bool text(std::string_view value, std::size_t bytes_max, const char* limit) {
    if (value.size() > bytes_max) return over(limit, bytes_max, value.size());
    Node* const node = push(Kind::string);
    if (node == nullptr) return false;
    node->text = tape.text.data() + tape.text.size();
    node->size = static_cast<std::uint32_t>(value.size());
    tape.text.insert(tape.text.end(), value.begin(), value.end());
    return true;
  }

  const DocumentLimits& limits_;
  std::vector<std::uint32_t> open_;  ///< the arrays and objects around the value, outermost first
};

}  // namespace api::json
