#pragma once
/// Names that stand for things defined elsewhere in the document.

#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "api/src/reader/cursor.h"
#include "api/src/reader/suggestion.h"

namespace api {

/// The index of a handle that points nowhere.
inline constexpr std::uint32_t nothing = std::numeric_limits<std::uint32_t>::max();

/// Looks the string at `at` up; tells when nothing has that name. `kind` is the plural for the sentence.
template <class Id>
Id find(Reading& reading, const Cursor& at, const std::map<std::string_view, Id>& names, std::string_view kind) {
  const auto found = names.find(at.node->string());
  if (found != names.end()) return found->second;
  if (reading.has_room()) {
    std::vector<std::string_view> candidates;
    for (const auto& [name, id] : names) {
      if (candidates.size() == 1000) break;
      candidates.push_back(name);
    }
    reading.issues.push_back({pointer(at), "unknown_reference",
                              quoted(at.node->string()) + " is not defined" +
                                  (names.empty() ? ": there are no named " + std::string(kind) : "") +
                                  did_you_mean(at.node->string(), candidates)});
  }
  return {nothing};
}

}  // namespace api
