/// POST /v1/render: a job whose submitter waits for the image. Waiting holds no thread.

#include <algorithm>
#include <utility>

#include "api/validation_json.h"
#include "server/http/handlers/handlers.h"
#include "server/http/negotiation.h"
#include "tracer/encode.h"

namespace http {
namespace {

using Deadline = std::chrono::steady_clock::time_point;

/// The formats on offer: first those the document asks for, in its order, then the others we can write.
std::vector<tracer::Format> offers(const std::vector<tracer::Format>& asked) {
  std::vector<tracer::Format> formats = asked;
  for (const tracer::Format format : tracer::all_formats) {
    if (std::find(formats.begin(), formats.end(), format) == formats.end()) formats.push_back(format);
  }
  return formats;
}

std::optional<tracer::Format> accepted(const Request& request, const std::vector<tracer::Format>& asked) {
  const std::vector<tracer::Format> formats = offers(asked);
  std::vector<std::string_view> types;
  for (const tracer::Format format : formats) types.push_back(tracer::media_type(format));
  const auto best = best_offer(request.head.header("accept"), types);
  if (!best) return std::nullopt;
  return formats[*best];
}

/// What Accept asks for beyond the document becomes part of the job.
void add_format(Scene& scene, tracer::Format format) {
  auto& formats = scene.parsed.scene.output.formats;
  if (std::find(formats.begin(), formats.end(), format) != formats.end()) return;
  scene.document = api::with_format(scene.document, format);
  formats.push_back(format);
}

Reply finished_image(const queue::Job& job, tracer::Format format, const ApiContext& front) {
  const auto artifact = std::find_if(job.artifacts.begin(), job.artifacts.end(), [&](const queue::Artifact& candidate) {
    return candidate.name == "image." + std::string(tracer::extension(format));
  });
  if (artifact == job.artifacts.end()) throw std::runtime_error("job " + job.id + " lacks the image it was to make");
  Reply reply = image_reply(job, *artifact, front);
  reply.headers.emplace_back("Content-Location", "/v1/jobs/" + job.id + "/" + artifact->name);
  return reply;
}

/// Who waits for an image.
struct Waiting {
  std::string id;  ///< of the job
  tracer::Format format = tracer::Format::png;
  Deadline deadline;
  std::string request_id;
  bool replayed = false;  ///< the job came with an earlier request under the same Idempotency-Key
};

Reply reply_for(const Waiting& waiting, const queue::JobView& view, const ApiContext& front) {
  if (view.job.expired) {
    return problem_reply({Failure::job_expired, "the images of job " + view.job.id + " are gone", {}},
                         waiting.request_id);
  }
  if (view.job.state == queue::JobState::succeeded) return finished_image(view.job, waiting.format, front);
  if (queue::ended(view.job.state)) return problem_reply(problem_of(view.job), waiting.request_id);
  return job_reply(202, view, front);
}

Answer forward_preview_request(const Waiting& waiting, const ApiContext& front, bool timed_out, bool durable = false);

/// Answers when the job has ended, or has not by then.
Answer wait_for(const Waiting& waiting, const ApiContext& front) {
  const auto watch = [front, id = waiting.id](std::function<void()> wake) -> std::function<void()> {
    const std::uint64_t token = front.queue.waiters.when_ended(id, std::move(wake));
    return [front, token] { front.queue.waiters.cancel(token); };
  };
  const auto resume = [waiting, front](bool late) { return forward_preview_request(waiting, front, late); };
  return DeferredReply{waiting.deadline, watch, resume};
}

Answer forward_preview_request(const Waiting& waiting, const ApiContext& front, bool timed_out, bool durable) {
  const auto view = front.queue.queries.find(waiting.id);
  if (!view) return problem_reply(no_such_job(waiting.id), waiting.request_id);
  if (timed_out && !durable && !queue::ended(view->job.state)) {
    front.queue.submission.make_durable(waiting.id);  // the reply 202 accepts the job
    return forward_preview_request(waiting, front, true, true);
  }
  if (timed_out || queue::ended(view->job.state)) {
    Reply reply = reply_for(waiting, *view, front);
    if (waiting.replayed) reply.headers.emplace_back("Idempotent-Replayed", "true");
    return reply;
  }
  return wait_for(waiting, front);
}

}  // namespace

Answer render(Request& request, const ApiContext& front) {
  auto scene = take_work(request, front);
  if (!scene) return problem_reply(scene.error(), request.id);
  const auto format = accepted(request, scene->parsed.scene.output.formats);
  if (!format)
    return problem_reply({Failure::not_acceptable, "accept image/png, image/x-exr or another image we make", {}},
                         request.id);
  add_format(*scene, *format);
  // As rendered: another format that the document does not name is another request.
  auto idempotency = idempotency_of(request, scene->document, front);
  if (!idempotency) return problem_reply(idempotency.error(), request.id);
  queue::Submission submission = submission_of(request, std::move(*scene), front);
  submission.durable = false;  // a client that loses the connection repeats the request
  do_once(submission, std::move(*idempotency), front);
  const auto submitted = front.queue.submission.submit(std::move(submission));
  if (!submitted) return problem_reply(problem_of(submitted.error()), request.id);
  const Deadline deadline = std::chrono::steady_clock::now() + front.render_wait;
  if (submitted->replayed) {
    const std::string id = submitted->replayed->location.substr(std::string_view("/v1/jobs/").size());
    return forward_preview_request({id, *format, deadline, request.id, true}, front, false);
  }
  if (submitted->from_cache) {
    Reply reply = finished_image(submitted->view.job, *format, front);
    reply.headers.emplace_back("X-Cache", "hit");
    return reply;
  }
  return wait_for({submitted->view.job.id, *format, deadline, request.id}, front);
}

}  // namespace http
