/// POST /v1/render: submits a job and replies with its image. Waiting occupies no thread.

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "api/validation_json.h"
#include "server/http/handlers/handlers.h"
#include "server/http/header_text.h"
#include "tracer/encode.h"

namespace http::handlers {
namespace {

/// The format that Accept prefers among those of the document, in its order, followed by all others.
std::optional<tracer::Format> accepted_format(const Request& request, std::vector<tracer::Format> formats) {
  for (const tracer::Format format : tracer::all_formats) {
    if (std::find(formats.begin(), formats.end(), format) == formats.end()) formats.push_back(format);
  }
  std::vector<std::string_view> types;
  for (const tracer::Format format : formats) types.push_back(tracer::media_type(format));
  const auto best = best_offer(request.head.header("accept"), types);
  return best ? std::optional(formats[*best]) : std::nullopt;
}

/// Adds an accepted format to the outputs of the document.
void add_format(Scene& scene, tracer::Format format) {
  auto& formats = scene.parsed.scene.output.formats;
  if (std::find(formats.begin(), formats.end(), format) != formats.end()) return;
  scene.document = api::with_format(scene.document, format);
  formats.push_back(format);
}

Reply rendered_image(const queue::Job& job, tracer::Format format, const ApiContext& context) {
  const std::string name = "image." + std::string(tracer::extension(format));
  const auto artifact = std::find_if(job.artifacts.begin(), job.artifacts.end(),
                                     [&](const queue::Artifact& candidate) { return candidate.name == name; });
  if (artifact == job.artifacts.end()) throw std::runtime_error("job " + job.id + " has no " + name);
  Reply reply = image_reply(job, *artifact, context);
  reply.headers.emplace_back("Content-Location", "/v1/jobs/" + job.id + "/" + name);
  return reply;
}

/// A request whose image is being rendered.
struct PendingRender {
  std::string job_id;
  tracer::Format format = tracer::Format::png;
  std::chrono::steady_clock::time_point deadline;
  std::string request_id;
  bool replayed = false;  ///< the job was submitted by an earlier request with the same Idempotency-Key
};

Answer reply_or_wait(const PendingRender& pending, const ApiContext& context, bool timed_out);

Answer wait_for_image(const PendingRender& pending, const ApiContext& context) {
  return defer_until_ended(pending.job_id, pending.deadline, context,
                           [pending, &context](bool late) { return reply_or_wait(pending, context, late); });
}

Answer reply_or_wait(const PendingRender& pending, const ApiContext& context, bool timed_out) {
  auto view = find_job(pending.job_id, context);
  if (view && timed_out && !queue::ended(view->job.state)) {
    context.queue.submission.make_durable(pending.job_id);  // the reply 202 accepts the job
    view = find_job(pending.job_id, context);
  }
  if (!view) return view.error();
  const queue::Job& job = view->job;
  const bool ended = queue::ended(job.state);
  if (!ended && !timed_out) return wait_for_image(pending, context);
  Reply reply;
  if (job.expired || (ended && job.state != queue::JobState::succeeded)) {
    reply = problem_reply(job.expired ? images_expired(job) : problem_of(job), pending.request_id);
  } else {
    reply = ended ? rendered_image(job, pending.format, context) : job_reply(202, *view, context);
  }
  if (pending.replayed) reply.headers.emplace_back("Idempotent-Replayed", "true");
  return reply;
}

}  // namespace

Answer render(Request& request, const ApiContext& context) {
  if (auto problem = refuse_if_draining(context)) return *problem;
  auto scene = take_scene(request, context);
  if (!scene) return scene.error();
  const auto format = accepted_format(request, scene->parsed.scene.output.formats);
  if (!format) {
    return Problem{failures::not_acceptable, "accept image/png, image/x-exr or another supported image format"};
  }
  add_format(*scene, *format);  // so that requests with different formats are different under an Idempotency-Key
  queue::Submission submission = submission_of(request, std::move(*scene), context);
  submission.durable = false;  // a client that loses the connection repeats the request
  const auto submitted = submit(request, std::move(submission), context);
  if (!submitted) return submitted.error();
  const auto deadline = std::chrono::steady_clock::now() + context.render_wait;
  if (submitted->replayed) {
    const std::string id = submitted->replayed->location.substr(std::string_view("/v1/jobs/").size());
    return reply_or_wait({id, *format, deadline, request.id, true}, context, false);
  }
  if (!submitted->from_cache) return wait_for_image({submitted->view.job.id, *format, deadline, request.id}, context);
  Reply reply = rendered_image(submitted->view.job, *format, context);
  reply.headers.emplace_back("X-Cache", "hit");
  return reply;
}

}  // namespace http::handlers
