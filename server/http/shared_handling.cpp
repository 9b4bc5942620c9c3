/// What several handlers share.

#include <algorithm>

#include "api/replies.h"
#include "server/http/handlers.h"
#include "server/http/negotiation.h"

namespace http {
namespace {

/// As jobs::IdSource writes them: nothing else reaches the store.
bool is_job_id(const std::string& text) {
  if (text.size() != 36) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool dash = i == 8 || i == 13 || i == 18 || i == 23;
    const bool hex = (text[i] >= '0' && text[i] <= '9') || (text[i] >= 'a' && text[i] <= 'f');
    if (dash ? text[i] != '-' : !hex) return false;
  }
  return true;
}

}  // namespace

std::optional<Problem> no_json_body(const Request& request, const char* what) {
  if (!request.head.content_length) {
    return Problem{Failure::length_required, std::string("send ") + what + " with its Content-Length", {}};
  }
  const auto type = request.head.header("content-type");
  if (type && is_json(*type)) return std::nullopt;
  const std::string seen = type ? "got \"" + std::string(*type) + "\"" : "there is none";
  return Problem{Failure::unsupported_media_type, "Content-Type must be application/json, " + seen, {}};
}

tracer::Result<Scene, Problem> take_scene(Request& request, const Front& front) {
  if (auto problem = no_json_body(request, "a scene document")) return *std::move(problem);
  Scene scene;
  scene.document = request.body.take();
  auto parsed = api::parse_scene(scene.document, front.limits);
  if (!parsed) return problem_of(parsed.error());
  scene.parsed = std::move(*parsed);
  if (front.missing_files) {
    api::Refusal refusal;
    refusal.issues = front.missing_files(scene.parsed.scene);
    if (!refusal.issues.empty()) return problem_of(refusal);
  }
  return scene;
}

tracer::Result<Scene, Problem> take_work(Request& request, const Front& front) {
  if (front.draining()) return Problem{Failure::draining, "nothing was stored; try again when it is back", {}};
  return take_scene(request, front);
}

Problem too_many_listeners(const Front& front) {
  return {Failure::too_many_streams,
          "the limit streams is " + std::to_string(front.events.listeners_max()) + ", of event streams and long polls",
          {}};
}

Problem no_such_job(const std::string& id) { return {Failure::job_not_found, "there is no job " + id, {}}; }

tracer::Result<jobs::JobView, Problem> find_job(const Request& request, const Front& front) {
  const std::string& id = request.path.front();
  if (!is_job_id(id)) return Problem{Failure::job_not_found, "that is no job id; ids are lower-case UUIDs", {}};
  auto view = front.jobs.find(id);
  if (!view) return no_such_job(id);
  return std::move(*view);
}

Reply job_reply(int status, const jobs::JobView& view, const Front& front) {
  Reply reply;
  reply.status = status;
  reply.content_type = "application/json";
  reply.body = api::write_job(view, front.clock());
  reply.job_id = view.job.id;
  if (status == 202) reply.headers.emplace_back("Location", "/v1/jobs/" + view.job.id);
  return reply;
}

Reply picture_reply(const jobs::Job& job, const jobs::Artifact& artifact, const Front& front) {
  const std::shared_ptr<const jobs::ArtifactReader> reader = front.jobs.open(artifact);
  if (!reader) throw std::runtime_error("the bytes of artifact " + artifact.sha256 + " are gone");
  Reply reply;
  reply.content_type = artifact.media_type;
  reply.headers.emplace_back("ETag", '"' + artifact.sha256 + '"');
  reply.job_id = job.id;
  reply.source = BodySource{reader->size_bytes(), [reader](std::uint64_t offset, char* into, std::size_t size) {
                              return reader->read(offset, into, size);
                            }};
  return reply;
}

}  // namespace http
