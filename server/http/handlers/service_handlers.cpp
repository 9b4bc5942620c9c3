#include "api/openapi.h"
#include "server/http/handlers/handlers.h"
#include "server/resources/problem_json.h"
#include "tracer/version.h"

namespace http {
namespace {

constexpr const char* index_text =
    "Whittle renders scenes.\n"
    "\n"
    "  POST /v1/render         a scene document in, its image out\n"
    "  POST /v1/jobs           a scene document in, a job out; then\n"
    "  GET  /v1/jobs/{id}            how far it is\n"
    "  GET  /v1/jobs/{id}/events     the same as it happens\n"
    "  GET  /v1/jobs/{id}/image.png  its image\n"
    "  GET  /v1/version        what runs here, within which limits\n"
    "  POST /v1/measure        what accuracy costs in a scene\n"
    "  POST /v1/batches        one scene in many variations\n"
    "  GET  /docs              all of it, for people\n"
    "  GET  /openapi.json      and for machines\n";

}  // namespace

Answer get_root(Request&) {
  Reply reply;
  reply.content_type = "text/plain; charset=utf-8";
  reply.body.append(index_text);
  return reply;
}

Answer get_version(Request&, const ApiContext& front) {
  Reply reply;
  reply.content_type = "application/json";
  reply.body = resources::write_version(tracer::version(), tracer::build(), front.sandbox(), front.effective_limits);
  return reply;
}

Answer get_openapi(Request&) {
  Reply reply;
  reply.content_type = "application/json";
  reply.body = api::openapi_json();
  return reply;
}

Answer get_docs(Request&) {
  Reply reply;
  reply.content_type = "text/html; charset=utf-8";
  // What could be in it is styled by it alone: no script, nothing from elsewhere.
  reply.headers.emplace_back("Content-Security-Policy", "default-src 'none'; style-src 'unsafe-inline'");
  reply.body = api::docs_html();
  return reply;
}

}  // namespace http
