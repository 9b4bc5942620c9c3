#pragma once
/// Names that stand for things defined elsewhere in the document.

#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/src/reader/cursor.h"
#include "api/src/reader/suggestion.h"

namespace api {

/// The index of a handle that points nowhere.
inline constexpr std::uint32_t invalid_index = std::numeric_limits<std::uint32_t>::max();

template <class Id>
void add_unknown_reference(Reading& reading, const Cursor& at, const Names<Id>& names, std::string_view kind) {
  if (!reading.can_add_issue()) return;
  std::vector<std::string_view> candidates;
  for (const auto& [name, id] : names.ids) {
    if (candidates.size() == suggestion_names_max) break;
    candidates.push_back(name);
  }
  std::string detail = quoted(at.node->string()) + " is not defined";
  if (candidates.empty()) detail.append(": there are no named ").append(kind);
  detail += did_you_mean(at.node->string(), candidates);
  reading.issues.push_back({pointer(at), "unknown_reference", std::move(detail)});
}

/// Looks the string at `at` up; tells when nothing has that name. `kind` is the plural for the sentence.
template <class Id>
Id find(Reading& reading, const Cursor& at, const Names<Id>& names, std::string_view kind) {
  const auto found = names.ids.find(at.node->string());
  if (found != names.ids.end()) return found->second;
  if (names.complete) add_unknown_reference(reading, at, names, kind);
  return {invalid_index};
}

}  // namespace api
