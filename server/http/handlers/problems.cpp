/// Problems of documents and of the queue.

#include <cassert>

#include "server/http/handlers/handlers.h"

namespace http::handlers {

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
  const std::size_t count = refusal.issues.size();
  return {failures::bad_scene, std::to_string(count) + (count == 1 ? " error" : " errors") + " in the document",
          refusal.issues};
}

Problem problem_of(const queue::Rejection& rejection) {
  using Reason = queue::Rejection::Reason;
  const std::string value = std::to_string(rejection.value);
  const std::string limit = std::to_string(rejection.limit) + "; nothing was stored";
  switch (rejection.reason) {
    case Reason::queue_full:
      return {failures::queue_full, value + " jobs are queued, the limit queued_jobs is " + limit};
    case Reason::owner_queued_jobs:
      return {failures::quota_exceeded, value + " of your jobs are queued, the limit key_queued_jobs is " + limit};
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
  if (!context.draining()) return std::nullopt;
  return Problem{failures::draining, "nothing was stored or changed; repeat the request after the restart"};
}

}  // namespace http::handlers
