#include "server/http/reply.h"

#include <algorithm>
#include <array>
#include <ctime>

#include "server/resources/problem_json.h"

namespace http {
namespace {

/// "200 OK". The reason phrase is optional (RFC 9112, section 4).
std::string status_text(int status) {
  constexpr std::array<std::string_view, 32> texts{"200 OK",
                                                   "201 Created",
                                                   "202 Accepted",
                                                   "204 No Content",
                                                   "206 Partial Content",
                                                   "303 See Other",
                                                   "304 Not Modified",
                                                   "400 Bad Request",
                                                   "401 Unauthorized",
                                                   "403 Forbidden",
                                                   "404 Not Found",
                                                   "405 Method Not Allowed",
                                                   "406 Not Acceptable",
                                                   "408 Request Timeout",
                                                   "409 Conflict",
                                                   "410 Gone",
                                                   "411 Length Required",
                                                   "412 Precondition Failed",
                                                   "413 Content Too Large",
                                                   "414 URI Too Long",
                                                   "415 Unsupported Media Type",
                                                   "416 Range Not Satisfiable",
                                                   "417 Expectation Failed",
                                                   "421 Misdirected Request",
                                                   "422 Unprocessable Content",
                                                   "428 Precondition Required",
                                                   "429 Too Many Requests",
                                                   "431 Request Header Fields Too Large",
                                                   "500 Internal Server Error",
                                                   "501 Not Implemented",
                                                   "503 Service Unavailable",
                                                   "505 HTTP Version Not Supported"};
  const std::string code = std::to_string(status) + ' ';
  const auto* const found =
      std::find_if(texts.begin(), texts.end(), [&](std::string_view text) { return text.starts_with(code); });
  return found == texts.end() ? code : std::string(*found);
}

std::string date_now() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 40> text{};
  std::strftime(text.data(), text.size(), "%a, %d %b %Y %H:%M:%S GMT", &utc);
  return text.data();
}

}  // namespace

Reply problem_reply(const Problem& problem, const std::string& request_id) {
  const FailureRule& rule = rule_of(problem.failure);
  Reply reply;
  reply.status = rule.status;
  reply.content_type = "application/problem+json";
  reply.body = resources::write_problem({"urn:whittle:problem:" + std::string(rule.name), std::string(rule.title),
                                         rule.status, problem.detail, request_id, problem.errors});
  if (rule.retry_after_s > 0) reply.headers.emplace_back("Retry-After", std::to_string(rule.retry_after_s));
  // RFC 6750, section 3
  if (problem.failure == Failure::unauthenticated) reply.headers.emplace_back("WWW-Authenticate", "Bearer");
  if (problem.failure == Failure::forbidden) {
    reply.headers.emplace_back("WWW-Authenticate", "Bearer error=\"insufficient_scope\"");
  }
  reply.failure = problem.failure;
  return reply;
}

std::string serialized(const Reply& reply, const std::string& request_id, bool keep_alive, bool to_head) {
  std::string text = "HTTP/1.1 " + status_text(reply.status) + "\r\n";
  const auto header = [&](std::string_view name, std::string_view value) {
    text.append(name).append(": ").append(value).append("\r\n");
  };
  header("Date", date_now());
  header("X-Request-Id", request_id);
  header("X-Content-Type-Options", "nosniff");
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
