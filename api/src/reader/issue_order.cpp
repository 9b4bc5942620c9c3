#include "api/src/reader/issue_order.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <numeric>
#include <string>
#include <string_view>
#include <utility>

namespace api {
namespace {

/// Trie over the tokens of the issues' pointers, so that each part of the document is visited once.
struct Token {
  std::map<std::string, Token> children;
  std::vector<std::size_t> issues;  ///< indices of the issues whose pointer ends here
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
    token = &token->children[unescaped(text)];
    pointer.remove_prefix(text.size());
  }
  token->issues.push_back(issue);
}

/// Sets the position of every issue at or below `token`.
void set_position(const Token& token, const json::Node* node, std::vector<const json::Node*>& positions) {
  for (const std::size_t issue : token.issues) positions[issue] = node;
  for (const auto& [text, child] : token.children) set_position(child, node, positions);
}

/// The same, with the position of the innermost existing value for each. Recursion is bounded by DocumentLimits::depth.
void find_positions(const Token& token, json::Node* node, json::Tape& tape, std::vector<const json::Node*>& positions) {
  set_position(token, node, positions);
  if (token.children.empty() || node->kind < json::Kind::array) return;
  const bool is_object = node->kind == json::Kind::object;
  json::Node* at = node + 1;
  for (std::size_t i = 0; i < node->size; ++i) {
    const auto found = token.children.find(is_object ? std::string(at->string()) : std::to_string(i));
    if (is_object) ++at;
    if (found != token.children.end()) find_positions(found->second, at, tape, positions);
    at = tape.next(at);
  }
}

}  // namespace

void sort_by_position(std::vector<tracer::Issue>& issues, json::Tape& tape, json::Node* root) {
  Token tokens;
  for (std::size_t i = 0; i < issues.size(); ++i) insert(tokens, issues[i].pointer, i);
  std::vector<const json::Node*> positions(issues.size());
  find_positions(tokens, root, tape, positions);
  std::vector<std::size_t> order(issues.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return positions[a] < positions[b]; });
  std::vector<tracer::Issue> sorted;
  for (const std::size_t i : order) sorted.push_back(std::move(issues[i]));
  issues = std::move(sorted);
}

}  // namespace api
