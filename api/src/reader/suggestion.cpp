#include "api/src/reader/suggestion.h"

#include <algorithm>
#include <array>
#include <cstddef>

namespace api {
namespace {

constexpr std::size_t word_bytes_max = 64;

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// Optimal string alignment distance: insertions, deletions, substitutions, swaps of neighbours; case is ignored.
std::size_t distance(std::string_view a, std::string_view b) {
  std::array<std::array<std::size_t, word_bytes_max + 1>, 3> rows{};
  for (std::size_t j = 0; j <= b.size(); ++j) rows[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    auto& row = rows[i % 3];
    const auto& above = rows[(i + 2) % 3];
    const auto& two_above = rows[(i + 1) % 3];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const bool same = lower(a[i - 1]) == lower(b[j - 1]);
      row[j] = std::min({above[j] + 1, row[j - 1] + 1, above[j - 1] + (same ? 0 : 1)});
      const bool swapped = i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) && lower(a[i - 2]) == lower(b[j - 1]);
      if (swapped) row[j] = std::min(row[j], two_above[j - 2] + 1);
    }
  }
  return rows[a.size() % 3][b.size()];
}

}  // namespace

std::string did_you_mean(std::string_view word, std::span<const std::string_view> names) {
  if (word.size() > word_bytes_max) return {};
  std::size_t nearest = std::max<std::size_t>(1, word.size() / 3) + 1;
  std::string_view suggestion;
  for (const std::string_view name : names.first(std::min(names.size(), suggestion_names_max))) {
    if (name.size() > word_bytes_max || name.size() >= word.size() + nearest || word.size() >= name.size() + nearest) {
      continue;
    }
    if (const std::size_t d = distance(word, name); d < nearest) {
      nearest = d;
      suggestion = name;
    }
  }
  return suggestion.empty() ? std::string() : "; did you mean \"" + std::string(suggestion) + "\"?";
}

}  // namespace api
