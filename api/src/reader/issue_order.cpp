#include "api/src/reader/issue_order.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <utility>

namespace api {
namespace {

/// The pointers that issues have, as a tree of their tokens, so that each part of the document is walked once.
struct Token {
  std::map<std::string, Token> inside;
  std::vector<std::size_t> issues;  ///< those whose pointer ends here
};

std::string unescaped(std::string_view token) {
  std::string text;
  for (std::size_t i = 0; i < token.size(); ++i) {
    const bool escape = token[i] == '~' && i + 1 < token.size();
    text += escape ? (token[++i] == '1' ? '/' : '~') : token[i];
  }
  return text;
}

void insert(Token& root, std::string_view pointer, std::size_t issue) {
  Token* token = &root;
  while (!pointer.empty()) {
    pointer.remove_prefix(1);
    const std::string_view text = pointer.substr(0, pointer.find('/'));
    token = &token->inside[unescaped(text)];
    pointer.remove_prefix(text.size());
  }
  token->issues.push_back(issue);
}

class Positions {
 public:
  Positions(json::Tape& tape, std::size_t issue_count) : tape_(tape), place_(issue_count) {}

  /// Everything at or below `token` is at `node`, or at what is inside it. Not deeper than DocumentLimits::depth.
  void walk(const Token& token, json::Node* node) {
    put(token, node);
    if (token.inside.empty() || node->kind < json::Kind::array) return;
    const bool is_object = node->kind == json::Kind::object;
    json::Node* at = node + 1;
    for (std::size_t i = 0; i < node->size; ++i) {
      const auto found = token.inside.find(is_object ? std::string(at->string()) : std::to_string(i));
      if (is_object) ++at;
      if (found != token.inside.end()) walk(found->second, at);
      at = tape_.next(at);
    }
  }

  [[nodiscard]] std::size_t operator[](std::size_t issue) const { return place_[issue]; }

 private:
  void put(const Token& token, json::Node* node) {
    for (const std::size_t issue : token.issues) place_[issue] = static_cast<std::size_t>(node - tape_.root());
    for (const auto& [text, inside] : token.inside) put(inside, node);
  }

  json::Tape& tape_;
  std::vector<std::size_t> place_;
};

}  // namespace

void sort_by_position(std::vector<tracer::Issue>& issues, json::Tape& tape, json::Node* root) {
  Token tokens;
  for (std::size_t i = 0; i < issues.size(); ++i) insert(tokens, issues[i].pointer, i);
  Positions places(tape, issues.size());
  places.walk(tokens, root);
  std::vector<std::size_t> order(issues.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return places[a] < places[b]; });
  std::vector<tracer::Issue> sorted;
  for (const std::size_t i : order) sorted.push_back(std::move(issues[i]));
  issues = std::move(sorted);
}

}  // namespace api
