#include "api/src/json/canonical.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <vector>

namespace api::json {
namespace {

class Writer {
 public:
  explicit Writer(Tape& tape) : tape_(tape) {}

  void write(Node* node, std::string_view omitted = {}) {
    switch (node->kind) {
      case Kind::null:
        text_ += "null";
        break;
      case Kind::boolean:
        text_ += node->truth ? "true" : "false";
        break;
      case Kind::number:
        write_number(node->number);
        break;
      case Kind::string:
        write_string(node->string());
        break;
      case Kind::array:
        write_array(node);
        break;
      case Kind::object:
        write_object(node, omitted);
        break;
    }
  }
  std::string take() { return std::move(text_); }

 private:
  void write_number(double number) {
    std::array<char, 32> digits{};
    text_.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr);
  }

  void write_string(std::string_view text) {
    constexpr std::string_view hex = "0123456789abcdef";
    text_ += '"';
    for (const char c : text) {
      const auto byte = static_cast<unsigned char>(c);
      if (c == '"' || c == '\\') text_ += '\\';
      if (byte >= 0x20) {
        text_ += c;
      } else {
        text_ += {'\\', 'u', '0', '0', hex[byte >> 4], hex[byte & 15]};
      }
    }
    text_ += '"';
  }

  void write_array(Node* node) {
    Node* element = node + 1;
    for (std::uint32_t i = 0; i < node->size; ++i, element = tape_.next(element)) {
      text_ += i == 0 ? '[' : ',';
      write(element);
    }
    text_ += node->size == 0 ? "[]" : "]";
  }

  void write_object(Node* node, std::string_view omitted) {
    std::vector<Node*> keys;
    Node* key = node + 1;
    for (std::uint32_t i = 0; i < node->size; ++i, key = tape_.next(key + 1)) {
      if (omitted.empty() || key->string() != omitted) keys.push_back(key);
    }
    std::stable_sort(keys.begin(), keys.end(), [](const Node* a, const Node* b) { return a->string() < b->string(); });
    text_ += '{';
    for (std::size_t i = 0; i < keys.size(); ++i) {
      if (i > 0) text_ += ',';
      write_string(keys[i]->string());
      text_ += ':';
      write(keys[i] + 1);
    }
    text_ += '}';
  }

  Tape& tape_;
  std::string text_;
};

}  // namespace

std::string canonical_text(Tape& tape, std::string_view omitted) {
  Writer writer(tape);
  writer.write(tape.root(), omitted);
  return writer.take();
}

}  // namespace api::json
