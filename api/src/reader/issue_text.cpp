#include "api/reader/issue_text.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace api {
namespace {

constexpr std::size_t word_bytes_max = 64;

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// Optimal string alignment distance: insertions, deletions, substitutions and swaps of neighbours, ignoring case.
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

// Names of fields and types in other programs (POV-Ray, pbrt, three.js, Blender, MTL files), and the form here.

/// Lines of words, in lower case and each between spaces, with the form that replaces them; a scope stands above.
constexpr std::string_view words_table =
#include "api/src/reader/foreign_words.txt"
    ;

/// The form that replaces `word`; empty if the word is not listed. `scope` is the kind of object that has the word
/// as a field ("a material"), or "type" for the value of a field `type`. Case, '_' and '-' are ignored.
std::string_view form_of_foreign_word(std::string_view scope, std::string_view word) {
  constexpr std::size_t longest = 32;
  if (word.size() > longest) return {};
  std::string plain = " ";
  for (const char c : word)
    if (c != '_' && c != '-' && c != ' ') plain += lower(c);
  plain += ' ';
  if (plain.size() == 2) return {};
  const std::string heading = "[" + std::string(scope) + "]";
  bool in_scope = false;
  for (std::string_view rest = words_table; !rest.empty();) {
    const std::string_view line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(line.size() + 1);
    if (line.starts_with('[')) in_scope = line == heading;
    const std::size_t form = line.find("> ");
    if (in_scope && form != line.npos && line.substr(0, form).find(plain) != line.npos) return line.substr(form + 2);
  }
  return {};
}

}  // namespace

std::string quoted(std::string_view text) {
  constexpr std::size_t bytes_max = 64;
  std::string result = "\"";
  std::size_t size = text.size();
  if (size > bytes_max) {
    size = bytes_max;
    while (size > 0 && (static_cast<unsigned char>(text[size]) & 0xC0) == 0x80) --size;  // not within a character
  }
  for (const char c : text.substr(0, size)) result += static_cast<unsigned char>(c) < 0x20 || c == 0x7F ? '?' : c;
  return result + (size < text.size() ? "...\"" : "\"");
}

std::string describe(const json::Node& node) {
  switch (node.kind) {
    case json::Kind::null:
      return "null";
    case json::Kind::boolean:
      return node.truth ? "true" : "false";
    case json::Kind::number:
      return "the number " + number_text(node.number);
    case json::Kind::string:
      return "the string " + quoted(node.string());
    case json::Kind::array:
      return "an array of " + std::to_string(node.size);
    case json::Kind::object:
      return "an object";
  }
  return {};
}

std::string number_text(double value) {
  return std::isinf(value) ? "a number too large for a double" : tracer::text_of(value);
}

std::string list_of(std::span<const std::string_view> words) {
  std::string list;
  for (const std::string_view word : words) list += (list.empty() ? "" : ", ") + quoted(word);
  return list;
}

std::string did_you_mean(std::string_view word, std::span<const std::string_view> names) {
  if (word.size() > word_bytes_max) return {};
  std::size_t nearest = 2 * std::max<std::size_t>(1, word.size() / 3) + 2;
  std::string_view suggestion;
  for (const std::string_view name : names.first(std::min(names.size(), suggestion_names_max))) {
    if (name.size() > word_bytes_max || name.size() >= word.size() + nearest || word.size() >= name.size() + nearest)
      continue;
    // A name of the same length is the likelier of two at the same distance.
    if (const std::size_t d = 2 * distance(word, name) + (name.size() != word.size() ? 1 : 0); d < nearest) {
      nearest = d;
      suggestion = name;
    }
  }
  return suggestion.empty() ? std::string() : "; did you mean \"" + std::string(suggestion) + "\"?";
}

std::string suggestion(std::string_view word, std::string_view kind, std::string_view group,
                       std::span<const std::string_view> names) {
  std::string_view form = form_of_foreign_word(kind, word);
  if (form.empty() && group != kind) {
    form = form_of_foreign_word(group, word);
    const auto is_first_name = [&](std::string_view name) { return form.starts_with(quoted(name)); };
    if (std::ranges::none_of(names, is_first_name) && !form.ends_with("in the document")) form = {};
  }
  return form.empty() ? did_you_mean(word, names) : "; write " + std::string(form);
}

}  // namespace api
