#include "server/http/handlers/routes.h"

#include <algorithm>

#include "server/http/handlers/handlers.h"
#include "server/http/header_text.h"

namespace http {

using namespace handlers;  // NOLINT(google-build-using-namespace): the loop names the lists of all files

namespace {

/// Loopback addresses and localhost, with or without a port.
bool is_this_machine(std::string_view host) {
  if (!host.empty() && host.front() == '[') return host.substr(0, host.find(']') + 1) == "[::1]";
  host = host.substr(0, host.find(':'));
  if (host.starts_with("127.")) {  // 127.0.0.0/8; a name with this prefix has letters
    return std::ranges::all_of(host, [](char c) { return c == '.' || (c >= '0' && c <= '9'); });
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

/// All endpoints, in the order in which their patterns are matched.
const Endpoints& all_endpoints() {
  static const Endpoints endpoints = [] {
    Endpoints all;
    for (Endpoints (*const list)() :
         {page_endpoints, service_endpoints, job_endpoints, event_endpoints, image_endpoints, view_endpoints,
          bulk_endpoints, compare_endpoints, batch_endpoints, animation_endpoints, webhook_endpoints, asset_endpoints})
      std::ranges::copy(list(), std::back_inserter(all));
    return all;
  }();
  return endpoints;
}

bool is_open(const std::string& path) {
  return std::ranges::any_of(all_endpoints(), [&](const Endpoint& endpoint) {
    return endpoint.rules.key == RequiredKey::none && match(endpoint.pattern, path);
  });
}

/// Tickets permit to read only.
bool reads(const RequestHead& head) { return head.method == "GET" || head.method == "HEAD"; }

std::optional<keys::Key> find_key(const RequestHead& head, const keys::KeyRing& ring) {
  if (head.ticket.empty() || !reads(head)) return ring.find(token_of(head));
  return ring.find_by_ticket(head.ticket, head.path);
}

Problem unauthenticated(const RequestHead& head) {
  if (!head.ticket.empty() && reads(head))
    return {failures::unauthenticated, "the ticket is not valid for this path now; POST /v1/tickets returns one"};
  if (head.header("authorization")) return {failures::unauthenticated, "the key in Authorization is not valid"};
  return {failures::unauthenticated, "send the header Authorization: Bearer KEY"};
}

/// Origin is "SCHEME://HOST[:PORT]", or "null" for pages without one (RFC 6454, section 7). A proxy may add TLS, so the
/// scheme does not count.
bool is_origin_of(std::string_view origin, std::string_view host) {
  const std::size_t scheme_end = origin.find("://");
  return scheme_end != std::string_view::npos && lowered(origin.substr(scheme_end + 3)) == lowered(host);
}

/// A request that a browser sends for a page of another site, with a method that may change something. Browsers send it
/// without a question to this service if it has no body (CSRF); they set both headers, and pages cannot.
std::optional<Problem> cross_site_problem(const RequestHead& head, std::string_view host) {
  if (head.method == "GET" || head.method == "HEAD" || head.method == "OPTIONS") return std::nullopt;
  const auto site = head.header("sec-fetch-site");
  if (site && *site != "same-origin" && *site != "none") {
    return Problem{
        failures::cross_site_request,
        "without keys, requests of pages of other sites are refused; Sec-Fetch-Site is " + std::string(*site)};
  }
  const auto origin = head.header("origin");
  if (!origin || is_origin_of(*origin, host)) return std::nullopt;
  return Problem{failures::cross_site_request,
                 "without keys, requests of pages of other sites are refused; Origin is " + std::string(*origin)};
}

using Context = std::shared_ptr<const ApiContext>;

Handler bound(ContextHandler* handler, const Context& context) {
  return [handler, context](Request& request) { return handler(request, *context); };
}

/// Names the job in the log, too.
Handler bound(JobHandler* handler, const Context& context) {
  return [handler, context](Request& request) -> Answer {
    const auto view = find_job(request.parameters.front(), *context);
    if (!view) return view.error();
    Answer answer = handler(request, *view, *context);
    if (auto* const reply = std::get_if<Reply>(&answer)) reply->job_id = view->job.id;
    return answer;
  };
}

Handler bound(BatchHandler* handler, const Context& context) {
  return [handler, context](Request& request) -> Answer {
    const auto state = find_batch(request.parameters.front(), *context);
    if (!state) return state.error();
    return handler(request, *state, *context);
  };
}

}  // namespace

tracer::Result<std::optional<keys::Key>, Problem> access_of(const RequestHead& head, const keys::KeyRing* ring) {
  if (ring == nullptr) {
    const std::string host(head.header("host").value_or(""));
    // HTTP/1.0 has no Host; browsers do not use it.
    if (!host.empty() && !is_this_machine(host))
      return Problem{failures::misdirected_request,
                     "without keys, Host must be localhost or a loopback address of this machine; it is " + host};
    if (auto problem = cross_site_problem(head, host)) return *std::move(problem);
    return std::optional<keys::Key>();
  }
  std::optional<keys::Key> key = find_key(head, *ring);
  if (!key && !is_open(head.path)) return unauthenticated(head);
  return key;
}

std::vector<Route> client_routes(const ApiContext& api_context) {
  const auto context = std::make_shared<const ApiContext>(api_context);
  std::vector<Route> routes;
  for (const auto& [method, pattern, handler, rules] : all_endpoints()) {
    const auto bind = [&](auto* function) { return bound(function, context); };
    routes.push_back({method, pattern, std::visit(bind, handler), rules});
  }
  return routes;
}

}  // namespace http
