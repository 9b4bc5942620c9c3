/// Replies about jobs, deferred ones, and problems of documents and of the queue.

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <string_view>
#include <utility>

#include "server/http/handlers/handlers.h"
#include "server/resources/resource_json.h"

namespace http::handlers {
const queue::Artifact* find_artifact(const queue::Job& job, std::string_view name) {
  const auto found = std::ranges::find(job.artifacts, name, &queue::Artifact::name);
  return found == job.artifacts.end() ? nullptr : &*found;
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

tracer::Result<queue::JobView, Problem> find_job(const std::string& id, const ApiContext& context) {
  if (!is_id(id)) return Problem{failures::job_not_found, "this is no job id; ids are lower-case UUIDs"};
  auto view = context.queue.queries.find(id);
  if (!view) return job_not_found(id);
  return std::move(*view);
}

std::string etag_of(queue::JobView view) {
  view.progress = std::floor(view.progress * 100) / 100;
  view.waiting_eta_s.reset();
  const std::size_t hash = std::hash<std::string>()(resources::write_job(view, view.job.started_at.value_or(0)));
  std::array<char, 20> text{};
  std::snprintf(text.data(), text.size(), "%016zx", hash);
  return "W/\"" + std::to_string(view.job.revision) + '-' + text.data() + '"';
}

Reply json_reply(int status, std::string body, const std::string& cache_control) {
  Reply reply{.status = status, .content_type = "application/json", .body = std::move(body)};
  if (!cache_control.empty()) reply.headers.emplace_back("Cache-Control", cache_control);
  return reply;
}

Reply job_reply(int status, const queue::JobView& view, const ApiContext& context) {
  Reply reply = json_reply(status, resources::write_job(view, context.clock()));
  reply.job_id = view.job.id;
  if (status == 202) reply.headers.emplace_back("Location", "/v1/jobs/" + view.job.id);
  return reply;
}

Reply replayed_reply(const queue::FirstReply& first) {
  Reply reply = json_reply(first.status, first.body);
  if (first.status == 202) reply.headers.emplace_back("Location", first.location);
  if (first.status == 200) reply.headers.emplace_back("X-Cache", "hit");  // only the result cache answers 200
  reply.headers.emplace_back("Idempotent-Replayed", "true");
  return reply;
}

BodySource source_of(std::shared_ptr<const queue::ArtifactReader> reader) {
  const std::uint64_t size_bytes = reader->size_bytes();
  return {size_bytes, [reader = std::move(reader)](std::uint64_t offset, char* into, std::size_t size) {
            return reader->read(offset, into, size);
          }};
}

tracer::Result<Reply, Problem> image_reply(const queue::Job& job, const queue::Artifact& artifact,
                                           const ApiContext& context) {
  auto reader = context.queue.queries.open(artifact);
  if (!reader) {
    return Problem{failures::image_damaged,
                   artifact.name + " of job " + job.id +
                       " is missing or its bytes have changed; retry the job to render it again"};
  }
  // A chart (SVG) may contain scripts if the worker was compromised.
  constexpr const char* policy = "default-src 'none'; style-src 'unsafe-inline'; sandbox";
  return Reply{.content_type = artifact.media_type,
               .headers = {{"Content-Security-Policy", policy}, {"ETag", '"' + artifact.sha256 + '"'}},
               .source = source_of(std::move(reader)),
               .job_id = job.id};
}

DeferredReply defer_until_ended(const std::string& id, Time deadline, const ApiContext& context,
                                std::function<Answer(bool timed_out)> resume) {
  queue::JobWaiters& waiters = context.queue.waiters;
  const auto watch = [&waiters, id](std::function<void()> notify) -> std::function<void()> {
    return [&waiters, token = waiters.when_ended(id, std::move(notify))] { waiters.cancel(token); };
  };
  return DeferredReply{deadline, watch, std::move(resume)};
}

static Answer answer_with(const ImageResult& result, const std::function<Answer(const ImageResult&)>& resume) {
  for (const Failure& failure :
       {failures::images_differ, failures::bad_image, failures::image_not_found, failures::bad_scene})
    if (result->code == failure.name) return Problem{failure, result->failure};
  if (!result->failure.empty()) return Problem{failures::image_not_processed, result->failure};
  return resume(result);
}

ImageResult ImageTasks::find(const std::string& key) {
  ImageResult result = results_.find(key).value_or(nullptr);
  return result && result->failure.empty() ? result : nullptr;
}

Answer ImageTasks::run(const std::string& key, const queue::ImageTask& task,
                       std::function<Answer(const ImageResult&)> resume) {
  if (const auto kept = results_.find(key)) return answer_with(*kept, resume);
  std::unique_lock lock(mutex_);
  const auto [found, is_new] = running_.try_emplace(key, std::make_shared<Running>());
  const auto self = shared_from_this();
  const auto running = found->second;
  lock.unlock();
  if (is_new)
    runner_.run_image_task(task, [self, key](queue::ImageTaskResult result) {
      self->end(key, std::make_shared<const queue::ImageTaskResult>(std::move(result)));
    });
  const auto watch = [self, running](const std::function<void()>& notify) -> std::function<void()> {
    std::unique_lock start(self->mutex_);
    const auto at = running->waiting.insert(running->waiting.end(), notify);
    const bool has_ended = running->result != nullptr;
    start.unlock();
    if (has_ended) notify();
    return [self, running, at] {
      const std::lock_guard stop(self->mutex_);
      running->waiting.erase(at);
    };
  };
  const auto answer = [self, running, resume = std::move(resume)](bool) -> Answer {
    std::unique_lock end(self->mutex_);
    const ImageResult result = running->result;
    end.unlock();
    return result ? answer_with(result, resume) : Problem{failures::overloaded, "the image was not ready in time"};
  };
  return DeferredReply{std::chrono::steady_clock::now() + wait_, watch, answer};
}

void ImageTasks::end(const std::string& key, const ImageResult& result) {
  constexpr std::size_t entry_bytes = 512;  // without its texts
  if (result->failure.empty() || !result->code.empty())
    results_.add(key, result, result->bytes.size() + result->text.size() + result->failure.size() + entry_bytes);
  std::unique_lock lock(mutex_);
  const auto running = running_.extract(key);
  running.mapped()->result = result;
  const auto waiting = running.mapped()->waiting;
  lock.unlock();
  for (const auto& notify : waiting) notify();
}

Problem with_errors(const Failure& failure, const std::string& where, std::vector<tracer::Issue> errors) {
  const std::string count = std::to_string(errors.size()) + (errors.size() == 1 ? " error " : " errors ");
  return {failure, count + where, std::move(errors)};
}

Problem problem_of(const api::Refusal& refusal) {
  switch (refusal.kind) {
    case api::Refusal::Kind::not_json:
      return {failures::not_json, "line " + std::to_string(refusal.line) + ", column " +
                                      std::to_string(refusal.column) + ": " + refusal.detail};
    case api::Refusal::Kind::too_large:
      return {failures::body_too_large, refusal.detail};
    case api::Refusal::Kind::invalid:
      break;
  }
  return with_errors(failures::bad_scene, "in the document", refusal.issues);
}

Problem request_problem(const api::Refusal& refusal) {
  Problem problem = problem_of(refusal);
  if (problem.failure != failures::bad_scene) return problem;
  return with_errors(failures::invalid_request, "in the request", std::move(problem.errors));
}

Problem problem_of(const queue::Rejection& rejection) {
  using Reason = queue::Rejection::Reason;
  const std::string value = std::to_string(rejection.value);
  const std::string limit = std::to_string(rejection.limit) + "; nothing was stored";
  const std::string more = " queued, " + std::to_string(rejection.added) + " more would exceed the limit ";
  switch (rejection.reason) {
    case Reason::queue_full:
      return {failures::queue_full, value + " jobs are" + more + "queued_jobs, which is " + limit};
    case Reason::owner_queued_jobs:
      return {failures::quota_exceeded, value + " of your jobs are" + more + "key_queued_jobs, which is " + limit};
    case Reason::owner_artifact_bytes:
      return {failures::quota_exceeded,
              "your images have " + value + " bytes, the limit key_artifact_bytes is " + limit + "; delete some"};
    case Reason::disk_full:
      return disk_full({queue::DiskSpace::State::scarce, static_cast<std::uint64_t>(rejection.value),
                        static_cast<std::uint64_t>(rejection.limit)});
    case Reason::key_reused:
      break;
  }
  return {failures::idempotency_key_reused, "this Idempotency-Key came with another request in the last 24 hours"};
}

Problem disk_full(const queue::DiskSpace& space) {
  return {failures::disk_full, queue::describe(space) + "; nothing was stored"};
}

Problem problem_of(const queue::Job& job) {
  assert(job.state == queue::JobState::failed || job.state == queue::JobState::cancelled);
  if (job.state == queue::JobState::cancelled) {
    return {failures::job_cancelled, "job " + job.id + " was cancelled before its image was finished"};
  }
  if (!job.problem) return {failures::job_failed, "job " + job.id + " failed"};
  const bool is_invalid = job.problem->code == "bad_scene" || job.problem->code == "bad_asset";
  return {is_invalid ? failures::bad_scene : failures::job_failed,
          "job " + job.id + ", " + job.problem->code + ": " + job.problem->detail, job.problem->errors};
}

Problem job_not_found(const std::string& id) { return {failures::job_not_found, "there is no job " + id}; }

Problem images_expired(const queue::Job& job) {
  return {failures::job_expired, "the images of job " + job.id + " have expired"};
}

Problem too_many_listeners(const ApiContext& context) {
  return {failures::too_many_streams,
          "the limit streams is " + std::to_string(context.events.listeners_max()) + " event streams and long polls"};
}

std::optional<Problem> refuse_if_draining(const ApiContext& context) {
  if (!context.readiness.draining()) return std::nullopt;
  return Problem{failures::draining, "nothing was stored or changed; repeat the request after the restart"};
}

}  // namespace http::handlers
