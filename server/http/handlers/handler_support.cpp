/// What several handlers share.

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <utility>

#include "api/estimate.h"
#include "api/report.h"
#include "server/http/handlers/handlers.h"
#include "server/http/negotiation.h"
#include "server/resources/job_json.h"
#include "tracer/encode.h"
#include "tracer/version.h"

namespace http {
namespace {

bool is_idempotency_key(std::string_view text) {
  const bool printable = std::all_of(text.begin(), text.end(), [](char c) { return c > 0x20 && c < 0x7F; });
  return printable && !text.empty() && text.size() <= 255;
}

/// Images of equal keys are equal. None for what is not decided by the document alone: files that may change under
/// their names, and a budget of time, for which an image is as good as the machine was idle.
std::string content_key_of(const Scene& scene, const ApiContext& front) {
  const tracer::Scene& meant = scene.parsed.scene;
  const bool on_waiters_notified =
      std::all_of(meant.assets.begin(), meant.assets.end(),
                  [](const tracer::Asset& asset) { return asset.name.starts_with(api::upload_prefix); });
  if (!on_waiters_notified || (meant.accuracy.adaptive && meant.accuracy.adaptive->time_budget_ms)) return {};
  std::string text(tracer::build());
  for (const tracer::Format format : meant.output.formats) text.append(" ").append(tracer::name(format));
  return front.sha256(text + "\n" + scene.canonical);
}

}  // namespace

tracer::Result<std::string, Problem> take_json(Request& request, std::string_view what) {
  if (!request.head.content_length) {
    return Problem{Failure::length_required, "send " + std::string(what) + " with its Content-Length", {}};
  }
  const auto type = request.head.header("content-type");
  if (!type || !is_json(*type)) {
    const std::string seen = type ? "got \"" + std::string(*type) + "\"" : "there is none";
    return Problem{Failure::unsupported_media_type, "Content-Type must be application/json, " + seen, {}};
  }
  return request.body.take();
}

tracer::Result<Scene, Problem> take_scene(Request& request, const ApiContext& front) {
  auto body = take_json(request, "a scene document");
  if (!body) return body.error();
  Scene scene;
  scene.document = std::move(*body);
  auto parsed = api::parse_scene(scene.document, front.limits, &scene.canonical);
  if (!parsed) return problem_of(parsed.error());
  scene.parsed = std::move(*parsed);
  api::Refusal refusal;
  refusal.issues = refused_here(scene.parsed.scene, api::estimated_memory_bytes(scene.parsed.scene), front);
  if (!refusal.issues.empty()) return problem_of(refusal);
  return scene;
}

std::vector<tracer::Issue> refused_here(const tracer::Scene& scene, std::uint64_t memory_bytes,
                                        const ApiContext& front) {
  std::vector<tracer::Issue> issues;
  if (front.missing_files) issues = front.missing_files(scene);
  if (memory_bytes > front.job_memory_bytes) {
    issues.push_back({"", "limit_exceeded",
                      "the limit job_memory_bytes is " + std::to_string(front.job_memory_bytes) +
                          ", the scene is estimated to take " + std::to_string(memory_bytes)});
  }
  return issues;
}

tracer::Result<Scene, Problem> take_work(Request& request, const ApiContext& front) {
  if (front.draining()) return Problem{Failure::draining, "nothing was stored; try again when it is back", {}};
  return take_scene(request, front);
}

Problem too_many_listeners(const ApiContext& front) {
  return {Failure::too_many_streams,
          "the limit streams is " + std::to_string(front.events.listeners_max()) + ", of event streams and long polls",
          {}};
}

queue::Submission submission_of(const Request& request, Scene scene, const ApiContext& front) {
  queue::Submission submission;
  submission.owner = request.owner;
  submission.content_key = content_key_of(scene, front);
  submission.accuracy = api::write_accuracy(scene.parsed.scene.accuracy);
  submission.document = std::move(scene.document);
  submission.parsed = std::move(scene.parsed);
  return submission;
}

tracer::Result<std::optional<queue::Idempotency>, Problem> idempotency_of(const Request& request,
                                                                          const std::string& body,
                                                                          const ApiContext& front) {
  const auto key = request.head.header("idempotency-key");
  if (!key) return std::optional<queue::Idempotency>();
  if (!is_idempotency_key(*key)) {
    return Problem{Failure::bad_header, "Idempotency-Key must have 1 to 255 printable ASCII characters", {}};
  }
  const std::string route = request.head.method + " " + request.head.path;
  return std::optional(queue::Idempotency{route, std::string(*key), front.sha256(body)});
}

void do_once(queue::Submission& submission, std::optional<queue::Idempotency> idempotency, const ApiContext& front) {
  submission.idempotency = std::move(idempotency);
  submission.write_reply = [&front](const queue::JobView& view, bool from_cache) -> queue::FirstReply {
    return {from_cache ? 200 : 202, "/v1/jobs/" + view.job.id, resources::write_job(view, front.clock())};
  };
}

bool is_id(const std::string& text) {
  if (text.size() != 36) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool dash = i == 8 || i == 13 || i == 18 || i == 23;
    const bool hex = (text[i] >= '0' && text[i] <= '9') || (text[i] >= 'a' && text[i] <= 'f');
    if (dash ? text[i] != '-' : !hex) return false;
  }
  return true;
}

Reply replayed_reply(const queue::FirstReply& first) {
  Reply reply;
  reply.status = first.status;
  reply.content_type = "application/json";
  reply.body = first.body;
  if (first.status == 202) reply.headers.emplace_back("Location", first.location);
  // Only the result cache answers 200.
  if (first.status == 200) reply.headers.emplace_back("X-Cache", "hit");
  reply.headers.emplace_back("Idempotent-Replayed", "true");
  return reply;
}

Problem no_such_job(const std::string& id) { return {Failure::job_not_found, "there is no job " + id, {}}; }

tracer::Result<queue::JobView, Problem> find_job(const Request& request, const ApiContext& front) {
  const std::string& id = request.parameters.front();
  if (!is_id(id)) return Problem{Failure::job_not_found, "that is no job id; ids are lower-case UUIDs", {}};
  auto view = front.queue.queries.find(id);
  if (!view) return no_such_job(id);
  return std::move(*view);
}

std::string etag_of(queue::JobView view) {
  view.progress = std::floor(view.progress * 100) / 100;
  std::uint64_t hash = 0xcbf29ce484222325;  // FNV-1a, 64 bits: it only tells states of one job apart
  for (const char c : resources::write_job(view, view.job.started_at.value_or(0))) {
    hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3;
  }
  std::array<char, 20> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(hash));
  return "W/\"" + std::to_string(view.job.revision) + '-' + text.data() + '"';
}

tracer::Result<std::optional<std::int64_t>, Problem> revision_asked_for(const Request& request) {
  const auto header = request.head.header("if-match");
  if (!header) return Problem{Failure::revision_required, "send If-Match with the job's ETag, or with *", {}};
  if (*header == "*") return std::optional<std::int64_t>();
  std::int64_t revision = 0;
  const char* const end = header->data() + header->size();
  const std::string_view opening = header->starts_with("W/") ? "W/\"" : "\"";
  const char* const begin = header->starts_with(opening) ? header->data() + opening.size() : end;
  const auto [rest, error] = std::from_chars(begin, end, revision);
  // Another's ETag matches no job, which is no mistake in the request (RFC 9110, section 13.1.1).
  if (error != std::errc{} || rest == end || *rest != '-') revision = -1;
  return std::optional(revision);
}

Reply job_reply(int status, const queue::JobView& view, const ApiContext& front) {
  Reply reply;
  reply.status = status;
  reply.content_type = "application/json";
  reply.body = resources::write_job(view, front.clock());
  reply.job_id = view.job.id;
  if (status == 202) reply.headers.emplace_back("Location", "/v1/jobs/" + view.job.id);
  return reply;
}

Reply image_reply(const queue::Job& job, const queue::Artifact& artifact, const ApiContext& front) {
  const std::shared_ptr<const queue::ArtifactReader> reader = front.queue.queries.open(artifact);
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
