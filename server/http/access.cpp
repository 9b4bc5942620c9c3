#include "server/http/access.h"

#include <algorithm>

#include "server/http/header_text.h"

namespace http {
namespace {

/// Loopback addresses and localhost, with or without a port.
bool is_this_machine(std::string_view host) {
  if (!host.empty() && host.front() == '[') return host.substr(0, host.find(']') + 1) == "[::1]";
  host = host.substr(0, host.find(':'));
  if (host.starts_with("127.")) {  // 127.0.0.0/8; a name with this prefix has letters
    return std::all_of(host.begin(), host.end(), [](char c) { return c == '.' || (c >= '0' && c <= '9'); });
  }
  return lowered(host) == "localhost";
}

/// The token of "Bearer TOKEN" (RFC 6750, section 2.1); the scheme is case-insensitive (RFC 9110, section 11.1).
std::string_view token_of(const RequestHead& head) {
  const std::string_view value = head.header("authorization").value_or("");
  constexpr std::string_view scheme = "bearer ";
  if (lowered(value.substr(0, scheme.size())) != scheme) return {};
  return trimmed(value.substr(scheme.size()));
}

bool is_open(const RequestHead& head) {
  return head.path == "/" || head.path == "/docs" || head.path == "/openapi.json";
}

Problem unauthenticated(const RequestHead& head) {
  if (head.header("authorization")) return {failures::unauthenticated, "the key in Authorization is not valid"};
  return {failures::unauthenticated, "send the header Authorization: Bearer KEY"};
}

}  // namespace

std::optional<Problem> refusal(const RequestHead& head, const keys::KeyRing* ring) {
  if (ring == nullptr) {
    const std::string host(head.header("host").value_or(""));
    if (host.empty() || is_this_machine(host)) return std::nullopt;  // HTTP/1.0 has no Host; browsers do not use it
    return Problem{failures::misdirected_request,
                   "without keys, Host must be localhost or a loopback address of this machine; it is " + host};
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
    if (!key) return problem_reply(unauthenticated(head), request.id);  // revoked since the head was checked
    const bool reads = head.method == "GET" || head.method == "HEAD";
    const keys::Scope scope = reads ? keys::Scope::jobs_read : keys::Scope::jobs_write;
    if (!key->allows(scope)) {
      const std::string detail = "key " + key->name + " does not have the scope " + std::string(name_of(scope));
      return problem_reply({failures::forbidden, detail}, request.id);
    }
    request.owner = key->name;
    return handler(request);
  };
}

}  // namespace http
