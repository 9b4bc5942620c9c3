#include "api/openapi.h"
#include "api/replies.h"
#include "server/http/handlers.h"
#include "tracer/version.h"

namespace http {
namespace {

constexpr std::string_view welcome =
    "Whittle renders scenes.\n"
    "\n"
    "  POST /v1/render         a scene document in, its picture out\n"
    "  POST /v1/jobs           a scene document in, a job out; then\n"
    "  GET  /v1/jobs/{id}            how far it is\n"
    "  GET  /v1/jobs/{id}/events     the same as it happens\n"
    "  GET  /v1/jobs/{id}/image.png  its picture\n"
    "  GET  /v1/version        what runs here, within which limits\n"
    "  GET  /openapi.json      all of it, for machines\n";

}  // namespace

Answer get_root(Request&) {
  Reply reply;
  reply.content_type = "text/plain; charset=utf-8";
  reply.body = welcome;
  return reply;
}

Answer get_version(Request&, const Front& front) {
  Reply reply;
  reply.content_type = "application/json";
  reply.body = api::write_version(tracer::version(), tracer::build(), front.sandbox(), front.told_limits);
  return reply;
}

Answer get_openapi(Request&) {
  Reply reply;
  reply.content_type = "application/json";
  reply.body = api::openapi_json();
  return reply;
}

}  // namespace http
