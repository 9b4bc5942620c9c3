/// The service itself: overview, version and limits, documentation; liveness, readiness and metrics of the health
/// listener, and its probe.

#include <httplib.h>

#include <algorithm>

#include "api/json.h"
#include "api/openapi.h"
#include "api/reader/fields.h"
#include "server/http/handlers/handlers.h"
#include "server/resources/resource_json.h"
#include "tracer/sha256.h"
#include "tracer/version.h"

namespace http::handlers {
namespace {

constexpr const char* index_text =
    "Whittle renders scenes.\n"
    "\n"
    "  POST /v1/render               renders a scene document and replies with the image\n"
    "  POST /v1/jobs                 submits a scene document as a job\n"
    "  GET  /v1/jobs/{id}            state and progress of a job\n"
    "  GET  /v1/jobs/{id}/events     the same as server-sent events\n"
    "  GET  /v1/jobs/{id}/image.png  image of a job\n"
    "  GET  /v1/version              version and limits of this service\n"
    "  POST /v1/measure              measures time against accuracy in a scene\n"
    "  POST /v1/batches              submits variations of a scene\n"
    "  GET  /docs                    documentation of all routes\n"
    "  GET  /docs/scene              documentation of scene documents\n"
    "  GET  /openapi.json            OpenAPI document\n"
    "  GET  /schemas/scene.schema.json  JSON schema of scene documents\n";

Reply document_reply(std::string content_type, std::string body) {
  return {.content_type = std::move(content_type), .body = std::move(body)};
}

Reply text_reply(std::string body) { return document_reply("text/plain; charset=utf-8", std::move(body)); }

/// A page that has its own style, no script and no external content.
template <std::string_view page()>
Answer get_page(Request&, const ApiContext&) {
  static const std::string etag = '"' + tracer::sha256_hex(page()) + '"';
  Reply reply = document_reply("text/html; charset=utf-8", std::string(page()));
  reply.headers = {{"ETag", etag},
                   {"Cache-Control", "no-cache"},
                   {"Content-Security-Policy", "default-src 'none'; style-src 'unsafe-inline'"}};
  return reply;
}

Answer get_version(Request&, const ApiContext& context) {
  return json_reply(200, resources::write_version(tracer::version(), tracer::build(), context.sandbox(),
                                                  context.dashboard, context.effective_limits));
}

Answer get_me(Request& request, const ApiContext& context) {
  const std::optional<keys::Key>& key = request.key;
  api::Json scopes = api::Json::array();
  for (const keys::Scope scope : {keys::Scope::jobs_read, keys::Scope::jobs_write, keys::Scope::admin})
    if (!key || key->allows(scope)) scopes.push_back(keys::name_of(scope));
  const auto usage_json = [](const queue::OwnerUsage& usage) -> api::Json {
    return {{"queued_jobs", usage.queued_jobs}, {"artifact_bytes", usage.artifact_bytes}};
  };
  queue::JobQueries& queries = context.queue.queries;
  const std::string owner = request.owner();
  return json_reply(200,
                    api::json_line({{"name", api::text_or_null(owner)},
                                    {"scopes", std::move(scopes)},
                                    {"quotas", usage_json(queries.owner_quota())},
                                    {"used", usage_json(queries.owner_usage(owner))}}),
                    "no-store");
}

Answer get_nodes(Request&, const ApiContext& context) {
  return json_reply(200, resources::write(context.nodes()), "no-store");
}

/// {"path": below /v1/, with or without a query}
void read_ticket(api::Reading& reading, std::string& path) {
  api::Fields fields(reading, reading.root, "the request");
  if (const auto at = fields.take_required("path"); at && read(reading, *at, path)) {
    const bool is_plain = std::ranges::all_of(path, [](char c) { return c > ' ' && c <= '~' && c != '#'; });
    if (!is_plain || !path.starts_with("/v1/")) add_issue(reading, *at, "malformed", "must be a path below /v1/");
  }
  fields.finish();
}

Answer create_ticket(Request& request, const ApiContext& context) {
  const auto target = take_request(request, "the path", read_ticket, context.limits);
  if (!target) return target.error();
  std::string url = *target;
  std::optional<std::string> expires_at;
  if (const auto& key = request.key) {
    const keys::Ticket ticket = context.keys->create_ticket(*key, target->substr(0, target->find('?')));
    url.append(url.find('?') == std::string::npos ? "?ticket=" : "&ticket=").append(ticket.text);
    expires_at = resources::time_text(ticket.expires_s * 1000);
  }
  return json_reply(200, api::json_line({{"url", url}, {"expires_at", api::or_null(expires_at)}}), "no-store");
}

Answer get_openapi(Request&, const ApiContext&) { return json_reply(200, std::string(api::openapi_json())); }

Answer get_scene_schema(Request&, const ApiContext&) {
  return document_reply("application/schema+json", std::string(api::scene_schema_json()));
}

Answer get_status(Request& request, const ApiContext& context) {
  const Pairs& query = request.head.query;
  const bool has_history = query.empty() || query.front().second == "true";
  if (!has_history && query.front().second != "false")
    return Problem{failures::invalid_query, "history must be true or false"};
  const bool draining = context.readiness.draining();  // read first: as soon as it is true, it is the reason too
  return json_reply(200,
                    resources::write(resources::ServiceStatus{
                        .not_ready = context.readiness.reason(),
                        .draining = draining,
                        .sandbox = context.sandbox(),
                        .gauges = context.gauges(),
                        .queue = context.queue.queries.state(),
                        .streams_max = context.events.listeners_max(),
                        .limits = context.effective_limits,
                        .hour = has_history ? std::optional(context.history.hour()) : std::nullopt}),
                    "no-store");
}

}  // namespace

Answer get_overview(const Request&) {
  Reply reply = text_reply(index_text);
  reply.headers.emplace_back("Vary", "Accept");
  return reply;
}

Endpoints service_endpoints() {
  return {{"GET", "/openapi.json", get_openapi, {.key = RequiredKey::none}},
          {"GET", "/docs", get_page<api::docs_html>, {.key = RequiredKey::none}},
          {"GET", "/docs/scene", get_page<api::scene_docs_html>, {.key = RequiredKey::none}},
          {"GET", "/schemas/scene.schema.json", get_scene_schema, {.key = RequiredKey::none}},
          {"GET", "/v1/version", get_version},
          {"GET", "/v1/me", get_me, {.key = RequiredKey::any}},
          {"GET", "/v1/status", get_status, {.query = {"history"}}},
          {"GET", "/v1/nodes", get_nodes},
          {"POST", "/v1/tickets", create_ticket, {.key = RequiredKey::reading}}};
}

}  // namespace http::handlers

namespace http {

std::string Readiness::reason() {
  if (draining_) return "draining";
  const std::lock_guard lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  if (!probed_at_ || now - *probed_at_ >= std::chrono::seconds(1)) {
    reason_ = not_ready_();
    probed_at_ = now;
  }
  return reason_;
}

std::vector<Route> health_routes(Readiness& readiness, const std::function<std::string()>& metrics) {
  // The daemon is alive if the event loop and the handlers run.
  const auto get_liveness = [](Request&) { return handlers::text_reply("alive\n"); };
  const auto get_readiness = [&readiness](Request&) -> Answer {
    const std::string reason = readiness.reason();
    if (!reason.empty()) return Problem{failures::not_ready, reason};
    return handlers::text_reply("ready\n");
  };
  const auto get_metrics = [metrics](Request&) {
    return handlers::document_reply("text/plain; version=0.0.4; charset=utf-8", metrics());
  };
  return {{"GET", "/healthz", get_liveness}, {"GET", "/readyz", get_readiness}, {"GET", "/metrics", get_metrics}};
}

Probe probe(const std::string& host, std::uint16_t port) {
  httplib::Client client(host == "0.0.0.0" ? "127.0.0.1" : host == "::" ? "::1" : host, port);
  client.set_connection_timeout(3);
  client.set_read_timeout(3);
  const httplib::Result result = client.Get("/readyz");
  std::string answer = "no answer to GET /readyz within 3 s; is this the option health_listen of a running daemon? ";
  if (!result) return {false, answer.append(httplib::to_string(result.error()))};
  const bool ready = result->status == 200;
  answer.assign(ready ? "" : "status " + std::to_string(result->status) + ": ");
  answer.append(result->body, 0, result->body.find_last_not_of('\n') + 1);
  return {ready, answer};
}

}  // namespace http
