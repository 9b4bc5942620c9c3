#include "api/src/json/canonical.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <nlohmann/json.hpp>
#include <vector>

namespace api::json {
namespace {

void append(std::string& text, Tape& tape, Node* node, std::string_view omitted = {});

void append_string(std::string& text, std::string_view value) { text += nlohmann::json(value).dump(); }

void append_array(std::string& text, Tape& tape, Node* node) {
  Node* element = node + 1;
  text += '[';
  for (std::uint32_t i = 0; i < node->size; ++i, element = tape.next(element)) {
    if (i > 0) text += ',';
    append(text, tape, element);
  }
  text += ']';
}

void append_object(std::string& text, Tape& tape, Node* node, std::string_view omitted) {
  std::vector<Node*> keys;
  Node* key = node + 1;
  for (std::uint32_t i = 0; i < node->size; ++i, key = tape.next(key + 1))
    if (omitted.empty() || key->string() != omitted) keys.push_back(key);
  std::stable_sort(keys.begin(), keys.end(), [](const Node* a, const Node* b) { return a->string() < b->string(); });
  text += '{';
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (i > 0) text += ',';
    append_string(text, keys[i]->string());
    text += ':';
    append(text, tape, keys[i] + 1);
  }
  text += '}';
}

void append(std::string& text, Tape& tape, Node* node, std::string_view omitted) {
  if (node->kind == Kind::null) text += "null";
  if (node->kind == Kind::boolean) text += node->truth ? "true" : "false";
  if (node->kind == Kind::number) {
    std::array<char, 32> digits{};
    text.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), node->number).ptr);
  }
  if (node->kind == Kind::string) append_string(text, node->string());
  if (node->kind == Kind::array) append_array(text, tape, node);
  if (node->kind == Kind::object) append_object(text, tape, node, omitted);
}

}  // namespace

std::string canonical_text(Tape& tape, std::string_view omitted) {
  std::string text;
  append(text, tape, tape.root(), omitted);
  return text;
}

}  // namespace api::json
