#include "server/http/router.h"

#include <algorithm>
#include <optional>
#include <set>

namespace http {
namespace {

/// The values of the {names} of `pattern` in `path`; nothing if the path does not match.
std::optional<std::vector<std::string>> match(std::string_view pattern, std::string_view path) {
  std::vector<std::string> parameters;
  for (;;) {
    const std::string_view expected = pattern.substr(0, pattern.find('/'));
    const std::string_view segment = path.substr(0, path.find('/'));
    const bool is_parameter = expected.starts_with('{') && !segment.empty();
    if (!is_parameter && expected != segment) return std::nullopt;
    if (is_parameter) parameters.emplace_back(segment);
    const bool pattern_ends = expected.size() == pattern.size(), path_ends = segment.size() == path.size();
    if (pattern_ends && path_ends) return parameters;
    if (pattern_ends || path_ends) return std::nullopt;
    pattern.remove_prefix(expected.size() + 1);
    path.remove_prefix(segment.size() + 1);
  }
}

/// Unknown query parameters are refused, like unknown fields of a document, because a typo must not be ignored.
std::optional<Problem> check_query(const Pairs& query, const Route& route) {
  std::string unknown, known;
  for (const auto& [name, value] : query) {
    const bool is_known = std::find(route.query.begin(), route.query.end(), name) != route.query.end();
    if (!is_known) unknown += (unknown.empty() ? "\"" : ", \"") + name + '"';
  }
  if (unknown.empty()) return std::nullopt;
  for (const std::string& name : route.query) known += (known.empty() ? "" : ", ") + name;
  return Problem{failures::invalid_query, "unknown: " + unknown + "; known: " + (known.empty() ? "none" : known)};
}

}  // namespace

Answer Router::answer(Request& request) const {
  const std::string path = percent_decoded(request.head.path).value_or(request.head.path);
  const std::string_view method = request.head.method == "HEAD" ? "GET" : std::string_view(request.head.method);
  std::set<std::string> allowed;
  for (const Route& route : routes_) {
    auto parameters = match(route.pattern, path);
    if (!parameters) continue;
    request.route = route.pattern;
    if (route.method == method) {
      request.parameters = *std::move(parameters);
      if (auto problem = check_query(request.head.query, route)) return *std::move(problem);
      return route.handler(request);
    }
    allowed.insert(route.method);
    if (route.method == "GET") allowed.insert("HEAD");
  }
  if (allowed.empty()) return Problem{failures::not_found, "there is nothing at " + request.head.path};
  std::string list;
  for (const std::string& name : allowed) list += (list.empty() ? "" : ", ") + name;
  const std::string detail = request.head.method + " is not allowed here; allowed: " + list;
  Reply reply = problem_reply({failures::method_not_allowed, detail}, request.id);
  reply.headers.emplace_back("Allow", list);
  return reply;
}

}  // namespace http
