#include "server/http/http_messages.h"

#include <ctime>

#include "server/resources/resource_json.h"
#include "server/support/text_values.h"

namespace http {
namespace {

constexpr std::string_view status_lines =
    "\n"
    "200 OK\n201 Created\n202 Accepted\n204 No Content\n206 Partial Content\n303 See Other\n304 Not Modified\n307 "
    "Temporary Redirect\n"
    "400 Bad Request\n401 Unauthorized\n403 Forbidden\n404 Not Found\n405 Method Not Allowed\n"
    "406 Not Acceptable\n408 Request Timeout\n409 Conflict\n410 Gone\n411 Length Required\n"
    "412 Precondition Failed\n413 Content Too Large\n414 URI Too Long\n415 Unsupported Media Type\n"
    "416 Range Not Satisfiable\n417 Expectation Failed\n421 Misdirected Request\n422 Unprocessable Content\n"
    "428 Precondition Required\n429 Too Many Requests\n431 Request Header Fields Too Large\n"
    "500 Internal Server Error\n501 Not Implemented\n503 Service Unavailable\n505 HTTP Version Not Supported\n";

/// "200 OK". The reason phrase is optional (RFC 9112, section 4).
std::string status_text(const std::string& code) {
  const std::size_t begin = status_lines.find('\n' + code + ' ');
  if (begin == std::string_view::npos) return code + ' ';
  return std::string(status_lines.substr(begin + 1, status_lines.find('\n', begin + 1) - begin - 1));
}

}  // namespace

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

std::optional<Problem> scope_problem(const std::optional<keys::Key>& key, const Route& route) {
  const RequiredKey required = route.rules.key;
  if (!key || required == RequiredKey::any || required == RequiredKey::none) return std::nullopt;
  const bool reads = required == RequiredKey::reading || route.method == "GET";
  const keys::Scope scope = reads ? keys::Scope::jobs_read : keys::Scope::jobs_write;
  if (key->allows(scope)) return std::nullopt;
  return Problem{failures::forbidden,
                 "key " + key->name + " does not have the scope " + std::string(keys::name_of(scope))};
}

Reply problem_reply(const Problem& problem, const std::string& request_id) {
  const Failure& failure = problem.failure;
  Reply reply{.status = failure.status, .content_type = "application/problem+json", .failure = failure};
  const std::string type = "urn:whittle:problem:" + std::string(failure.name);
  reply.body = resources::write(resources::ProblemReply{type, std::string(failure.title), failure.status,
                                                        problem.detail, request_id, problem.errors});
  if (failure.retry_after_s > 0) reply.headers.emplace_back("Retry-After", std::to_string(failure.retry_after_s));
  // RFC 6750, section 3
  if (failure == failures::unauthenticated) reply.headers.emplace_back("WWW-Authenticate", "Bearer");
  if (failure == failures::forbidden) {
    reply.headers.emplace_back("WWW-Authenticate", "Bearer error=\"insufficient_scope\"");
  }
  return reply;
}

std::string serialized(const Reply& reply, const std::string& request_id, bool keep_alive, bool to_head) {
  std::string text = "HTTP/1.1 " + status_text(std::to_string(reply.status)) + "\r\n";
  const auto header = [&](std::string_view name, std::string_view value) {
    text.append(name).append(": ").append(value).append("\r\n");
  };
  header("Date", support::in_utc(std::time(nullptr), "%a, %d %b %Y %H:%M:%S GMT"));
  header("X-Request-Id", request_id);
  header("X-Content-Type-Options", "nosniff");
  // Pages of other sites cannot show images (Fetch, section 3.7).
  header("Cross-Origin-Resource-Policy", "same-origin");
  for (const auto& [name, value] : reply.headers) header(name, value);
  if (!reply.content_type.empty()) header("Content-Type", reply.content_type);
  if (reply.status != 204 && reply.status != 304 && !reply.stream) {  // a stream ends with the connection
    header("Content-Length", std::to_string(reply.source ? reply.source->size_bytes : reply.body.size()));
  }
  header("Connection", keep_alive ? "keep-alive" : "close");
  text += "\r\n";
  if (!to_head) text += reply.body;
  return text;
}

}  // namespace http
