/// The service itself: overview, version and limits, documentation.

#include "api/openapi.h"
#include "server/http/handlers/handlers.h"
#include "server/resources/resource_json.h"
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
    "  GET  /openapi.json            OpenAPI document\n";

Reply document_reply(std::string content_type, std::string body) {
  Reply reply;
  reply.content_type = std::move(content_type);
  reply.body = std::move(body);
  return reply;
}

}  // namespace

Answer get_root(Request&) { return document_reply("text/plain; charset=utf-8", index_text); }

Answer get_version(Request&, const ApiContext& context) {
  return json_reply(
      200, resources::write_version(tracer::version(), tracer::build(), context.sandbox(), context.effective_limits));
}

Answer get_openapi(Request&) { return json_reply(200, std::string(api::openapi_json())); }

Answer get_docs(Request&) {
  Reply reply = document_reply("text/html; charset=utf-8", std::string(api::docs_html()));
  // The page has its own style, no script and no external content.
  reply.headers.emplace_back("Content-Security-Policy", "default-src 'none'; style-src 'unsafe-inline'");
  return reply;
}

}  // namespace http::handlers
