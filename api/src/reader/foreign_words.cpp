#include "api/src/reader/foreign_words.h"

#include <string>

namespace api {
namespace {

/// Lines of words, in lower case and each between spaces, with the form that replaces them; a scope stands above.
constexpr std::string_view words_table =
#include "api/src/reader/foreign_words.txt"
    ;

}  // namespace

std::string_view form_of_foreign_word(std::string_view scope, std::string_view word) {
  constexpr std::size_t longest = 32;
  if (word.size() > longest) return {};
  std::string plain = " ";
  for (const char c : word)
    if (c != '_' && c != '-' && c != ' ') plain += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
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

}  // namespace api
