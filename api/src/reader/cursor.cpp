#include "api/reader/cursor.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <utility>

#include "api/reader/issue_text.h"

namespace api {
namespace {

void append_token(std::string& text, std::string_view key) {
  text += '/';
  for (const char c : key) {
    if (c == '~' || c == '/') text += '~';
    text += c == '~' ? '0' : c == '/' ? '1' : c;
  }
}

void append_pointer(std::string& text, const Cursor& at) {
  if (at.parent == nullptr) return;  // not deeper than DocumentLimits::depth
  append_pointer(text, *at.parent);
  append_token(text, at.is_member ? at.key : std::to_string(at.index));
}

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

/// Sorts issues by the position of the value that their pointers name, from `root`; a missing value has the position of
/// the object that should contain it. Issues at one position keep their order. Time is linear in the document for any
/// number of issues.
void sort_by_position(std::vector<tracer::Issue>& issues, json::Tape& tape, json::Node* root) {
  Token tokens;
  for (std::size_t i = 0; i < issues.size(); ++i) insert(tokens, issues[i].pointer, i);
  std::vector<const json::Node*> positions(issues.size());
  find_positions(tokens, root, tape, positions);
  std::vector<std::size_t> order(issues.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t i) { return positions[i]; });
  std::vector<tracer::Issue> sorted;
  for (const std::size_t i : order) sorted.push_back(std::move(issues[i]));
  issues = std::move(sorted);
}

}  // namespace

std::string pointer(const Cursor& at) {
  std::string text;
  append_pointer(text, at);
  return text;
}

std::string pointer_to_member(const Cursor& at, std::string_view key) {
  std::string text = pointer(at);
  append_token(text, key);
  return text;
}

bool Reading::can_add_issue() {
  if (issues.size() < issues_max) return true;
  ++omitted_issues;
  return false;
}

std::vector<tracer::Issue> Reading::take_issues() {
  sort_by_position(issues, tape, root.node);
  if (omitted_issues > 0) issues.push_back({"", "too_many_issues", "and " + std::to_string(omitted_issues) + " more"});
  return std::move(issues);
}

bool add_issue(Reading& reading, const Cursor& at, std::string_view code, std::string detail) {
  if (reading.can_add_issue()) reading.issues.push_back({pointer(at), std::string(code), std::move(detail)});
  return false;
}

bool add_wrong_type(Reading& reading, const Cursor& at, std::string_view expected) {
  if (reading.can_add_issue())
    reading.issues.push_back(
        {pointer(at), "wrong_type", "must be " + std::string(expected) + ", got " + describe(*at.node)});
  return false;
}

bool add_limit_exceeded(Reading& reading, const Cursor& at, std::string_view limit, std::uint64_t bound,
                        std::uint64_t seen) {
  return add_issue(
      reading, at, "limit_exceeded",
      "the limit " + std::string(limit) + " is " + std::to_string(bound) + ", got " + std::to_string(seen));
}

}  // namespace api
