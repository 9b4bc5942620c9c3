#include "server/http/access.h"

#include <algorithm>

namespace http {
namespace {

/// "127.0.0.1:8080", "[::1]", "localhost": how a browser or a tool on this machine calls it.
bool is_this_machine(std::string_view host) {
  if (!host.empty() && host.front() == '[') return host.substr(0, host.find(']') + 1) == "[::1]";
  host = host.substr(0, host.find(':'));
  if (host.starts_with("127.")) {  // 127.0.0.0/8; a name that only begins so has other letters
    return std::all_of(host.begin(), host.end(), [](char c) { return c == '.' || (c >= '0' && c <= '9'); });
  }
  std::string lower(host);
  std::transform(lower.begin(), lower.end(), lower.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? c + 32 : c; });
  return lower == "localhost";
}

/// "Bearer TOKEN" (RFC 6750, section 2.1; the scheme in any case: RFC 9110, section 11.1).
std::string_view token_of(const RequestHead& head) {
  const std::string_view value = head.header("authorization").value_or("");
  constexpr std::string_view scheme = "bearer ";
  const bool bearer = value.size() > scheme.size() &&
                      std::equal(scheme.begin(), scheme.end(), value.begin(),
                                 [](char wanted, char c) { return wanted == (c >= 'A' && c <= 'Z' ? c + 32 : c); });
  if (!bearer) return {};
  const std::string_view rest = value.substr(scheme.size());
  return rest.substr(std::min(rest.find_first_not_of(' '), rest.size()));
}

bool is_open(const RequestHead& head) {
  return head.path == "/" || head.path == "/docs" || head.path == "/openapi.json";
}

Problem unauthenticated(const RequestHead& head) {
  const bool none = !head.header("authorization");
  return {Failure::unauthenticated,
          none ? "send the header Authorization: Bearer KEY" : "the key in Authorization is not known here",
          {}};
}

}  // namespace

std::optional<Problem> refusal(const RequestHead& head, const keys::KeyRing* ring) {
  if (ring == nullptr) {
    const std::string host(head.header("host").value_or(""));
    if (host.empty() || is_this_machine(host)) return std::nullopt;  // HTTP/1.0 has none; browsers do not speak it
    return Problem{Failure::misdirected,
                   "without keys only this machine is served, as localhost or by its loopback address; Host is " + host,
                   {}};
  }
  if (is_open(head) || ring->find(token_of(head))) return std::nullopt;
  return unauthenticated(head);
}

Handler with_access(const Handler& handler, const keys::KeyRing* ring) {
  if (ring == nullptr) return handler;
  return [handler, ring](Request& request) -> Answer {
    const RequestHead& head = request.head;
    if (is_open(head)) return handler(request);
    const auto key = ring->find(token_of(head));
    if (!key) return problem_reply(unauthenticated(head), request.id);  // taken back since the head was judged
    const bool reads = head.method == "GET" || head.method == "HEAD";
    const keys::Scope scope = reads ? keys::Scope::jobs_read : keys::Scope::jobs_write;
    if (!key->allows(scope)) {
      const std::string detail = "key " + key->name + " lacks the scope " + std::string(name_of(scope));
      return problem_reply({Failure::forbidden, detail, {}}, request.id);
    }
    request.owner = key->name;
    return handler(request);
  };
}

}  // namespace http
