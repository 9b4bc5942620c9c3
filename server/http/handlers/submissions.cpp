/// From the body of a request to a submitted job.

#include <algorithm>
#include <utility>

#include "api/estimate.h"
#include "api/json.h"
#include "api/report.h"
#include "server/http/handlers/handlers.h"
#include "server/http/header_text.h"
#include "server/resources/resource_json.h"
#include "tracer/encode.h"
#include "tracer/sha256.h"
#include "tracer/version.h"

namespace http::handlers {
namespace {

bool is_idempotency_key(std::string_view text) {
  const bool printable = std::ranges::all_of(text, [](char c) { return c > 0x20 && c < 0x7F; });
  return printable && !text.empty() && text.size() <= 255;
}

/// Images with equal keys are equal. Empty if the document alone does not determine the image: files of the asset
/// directory may change, and a time budget depends on the load of the machine.
std::string content_key_of(const Scene& scene) {
  const tracer::Scene& parsed = scene.parsed.scene;
  if (scene.content.named_files || (parsed.accuracy.adaptive && parsed.accuracy.adaptive->time_budget_ms)) return {};
  std::string text(tracer::build());
  for (const tracer::Format format : parsed.output.formats) text.append(" ").append(tracer::name(format));
  for (const auto& [name, sha256] : scene.digests) text.append("\n").append(name).append(" ").append(sha256);
  return tracer::sha256_hex(text);
}

bool has_model(const Request& request) {
  const auto type = request.head.header("content-type");
  return type && type->substr(0, type->find(';')) == model_type;
}

/// Keeps the model as an upload. The worker imports it: the daemon reads no file of a user.
tracer::Result<std::string, Problem> take_model(Request& request, const ApiContext& context) {
  const queue::DiskSpace space = context.queue.queries.disk_space();
  if (space.state != queue::DiskSpace::State::enough) return disk_full(space);
  const std::string bytes = request.body.take(), sha256 = tracer::sha256_hex(bytes);
  const auto put = context.assets.put(
      sha256, [&](std::uint64_t offset, char* into, std::size_t size) { return bytes.copy(into, size, offset); });
  if (put == queue::AssetStore::Put::quota_exceeded) return uploads_full(bytes.size(), context);
  return api::json_line({{"version", 1}, {"model", std::string(api::upload_prefix) + sha256}});
}

}  // namespace

tracer::Result<std::string, Problem> take_json(Request& request, std::string_view what, std::string_view other_type,
                                               std::string_view named_type) {
  if (!request.head.content_length) {
    return Problem{failures::length_required, "send " + std::string(what) + " with its Content-Length"};
  }
  const auto type = request.head.header("content-type");
  if (type && (is_json(*type) || (!other_type.empty() && is_json(*type, other_type)))) return request.body.take();
  const std::string value = type ? "it is \"" + std::string(*type) + "\"" : "it is missing";
  if (named_type.empty()) named_type = other_type;
  const std::string alternative = named_type.empty() ? "" : " or " + std::string(named_type);
  return Problem{failures::unsupported_media_type,
                 "Content-Type must be application/json" + alternative + ", " + value};
}

tracer::Result<Scene, Problem> take_scene(Request& request, const ApiContext& context) {
  auto body = has_model(request) && request.head.content_length
                  ? take_model(request, context)
                  : take_json(request, "a scene document", {}, model_type);
  if (!body) return body.error();
  Scene scene;
  scene.document = std::move(*body);
  auto parsed = api::parse_scene(scene.document, context.limits, &scene.digests);
  if (!parsed) return problem_of(parsed.error());
  scene.parsed = std::move(*parsed);
  scene.content = api::content_of(scene.parsed.scene);
  const std::uint64_t memory_bytes = api::estimated_memory_bytes(scene.parsed.scene, scene.content);
  if (auto problem = deployment_problem(scene.parsed.scene, memory_bytes, "", context)) return *std::move(problem);
  return scene;
}

std::optional<Problem> deployment_problem(const tracer::Scene& scene, std::uint64_t memory_bytes, const char* at,
                                          const ApiContext& context) {
  std::vector<tracer::Issue> issues = context.missing_files(scene);
  if (memory_bytes > context.job_memory_bytes) {
    issues.push_back({"", "limit_exceeded",
                      "the limit job_memory_bytes is " + std::to_string(context.job_memory_bytes) +
                          ", the estimate for the scene is " + std::to_string(memory_bytes)});
  }
  if (issues.empty()) return std::nullopt;
  for (tracer::Issue& issue : issues) issue.pointer.insert(0, at);
  return with_errors(failures::bad_scene, "in the document", std::move(issues));
}

queue::Submission submission_of(const Request& request, const tracer::Scene& scene, api::JobRequest wanted) {
  queue::Submission submission;
  queue::Job& job = submission.job;
  static_cast<api::JobRequest&>(job) = std::move(wanted);
  job.owner = request.owner();
  if (request.key) job.weight = request.key->weight;
  job.accuracy = api::write_accuracy(scene.accuracy);
  job.width = scene.image.window().width();
  job.height = scene.image.window().height();
  for (const tracer::Asset& asset : scene.assets) {
    if (asset.name.starts_with(api::upload_prefix)) job.assets.push_back(asset.name.substr(api::upload_prefix.size()));
  }
  return submission;
}

queue::Submission submission_of(const Request& request, Scene scene, const ApiContext& context) {
  const tracer::Scene& parsed = scene.parsed.scene;
  queue::Submission submission = submission_of(request, parsed, std::move(scene.parsed.job));
  queue::Job& job = submission.job;
  job.content_key = content_key_of(scene);
  job.formats.clear();
  for (const tracer::Format format : parsed.output.formats)
    job.formats.append(job.formats.empty() ? "" : " ").append(tracer::row(format).extension);
  job.large = api::is_large(parsed, scene.content);
  const std::optional<double> seconds_per_work = context.queue.queries.seconds_per_work();
  job.work = queue::work_of(api::estimated_work(parsed, scene.content, seconds_per_work).value_or(0));
  submission.document = std::move(scene.document);
  submission.durable = job.keep;
  return submission;
}

tracer::Result<std::optional<queue::Idempotency>, Problem> idempotency_of(const Request& request,
                                                                          const std::string& body) {
  const auto key = request.head.header("idempotency-key");
  if (!key) return std::optional<queue::Idempotency>();
  if (!is_idempotency_key(*key)) {
    return Problem{failures::invalid_header, "Idempotency-Key must have 1 to 255 printable ASCII characters"};
  }
  const std::string route = request.head.method + " " + request.head.path;
  return std::optional(queue::Idempotency{route, std::string(*key), tracer::sha256_hex(body)});
}

tracer::Result<queue::Submitted, Problem> submit(const Request& request, queue::Submission submission,
                                                 const ApiContext& context) {
  auto idempotency = idempotency_of(request, submission.document);
  if (!idempotency) return idempotency.error();
  submission.idempotency = std::move(*idempotency);
  submission.write_reply = [&](const queue::JobView& view, bool from_cache) -> queue::FirstReply {
    return {from_cache ? 200 : 202, "/v1/jobs/" + view.job.id, resources::write_job(view, context.clock())};
  };
  auto submitted = context.queue.submission.submit(std::move(submission));
  if (!submitted) return problem_of(submitted.error());
  return std::move(*submitted);
}

}  // namespace http::handlers
