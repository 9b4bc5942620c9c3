/// Problems of the documents and of the queue.

#include <cassert>

#include "server/http/handlers/handlers.h"

namespace http {

Problem problem_of(const api::Refusal& refusal) {
  switch (refusal.kind) {
    case api::Refusal::Kind::not_json:
      return {
          Failure::not_json,
          "line " + std::to_string(refusal.line) + ", column " + std::to_string(refusal.column) + ": " + refusal.detail,
          {}};
    case api::Refusal::Kind::too_large:
      return {Failure::body_too_large, refusal.detail, {}};
    case api::Refusal::Kind::invalid:
      break;
  }
  const std::size_t count = refusal.issues.size();
  return {Failure::bad_scene, std::to_string(count) + (count == 1 ? " error" : " errors") + " in the document",
          refusal.issues};
}

Problem disk_full(const queue::DiskSpace& room) {
  return {Failure::disk_full, queue::describe(room) + "; nothing was stored", {}};
}

Problem problem_of(const queue::Rejection& refused) {
  using Reason = queue::Rejection::Reason;
  const std::string seen = std::to_string(refused.value);
  const std::string limit = std::to_string(refused.limit) + "; nothing was stored";
  switch (refused.reason) {
    case Reason::queue_full:
      return {Failure::queue_full, seen + " jobs wait, the limit queued_jobs is " + limit, {}};
    case Reason::owner_queued_jobs:
      return {Failure::quota_exceeded, seen + " jobs of yours wait, the limit key_queued_jobs is " + limit, {}};
    case Reason::owner_artifact_bytes:
      return {Failure::quota_exceeded,
              "your images have " + seen + " bytes, the limit key_artifact_bytes is " + limit + "; delete some",
              {}};
    case Reason::disk_full:
      return disk_full({queue::DiskSpace::State::scarce, static_cast<std::uint64_t>(refused.value),
                        static_cast<std::uint64_t>(refused.limit)});
    case Reason::key_reused:
      break;
  }
  return {Failure::key_reused, "this Idempotency-Key came with another request in the last 24 hours", {}};
}

Problem problem_of(const queue::Job& job) {
  assert(job.state == queue::JobState::failed || job.state == queue::JobState::cancelled);
  if (job.state == queue::JobState::cancelled) {
    return {Failure::job_cancelled, "job " + job.id + " was cancelled before its image was finished", {}};
  }
  if (!job.problem) return {Failure::job_failed, "job " + job.id + " failed", {}};
  const bool submitters = job.problem->code == "bad_scene" || job.problem->code == "bad_asset";
  const Failure failure = submitters ? Failure::bad_scene : Failure::job_failed;
  return {failure, "job " + job.id + ", " + job.problem->code + ": " + job.problem->detail, job.problem->errors};
}

}  // namespace http
