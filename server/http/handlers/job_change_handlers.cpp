/// What an owner may change of a job that is there, and what the queue as a whole looks like.

#include "api/job_patch.h"
#include "server/http/handlers/handlers.h"
#include "server/resources/queue_json.h"

namespace http {
namespace {

/// A change that another one came before is made anew this often, when its owner does not care.
constexpr int tries_max = 16;

/// The labels of `job` with those asked for merged in.
std::map<std::string, std::string> merged(const queue::Job& job,
                                          const std::map<std::string, std::optional<std::string>>& asked) {
  std::map<std::string, std::string> labels = job.labels;
  for (const auto& [name, value] : asked) {
    if (value) {
      labels.insert_or_assign(name, *value);
    } else {
      labels.erase(name);
    }
  }
  return labels;
}

tracer::Result<queue::JobChange, Problem> change_of(const queue::Job& job, const api::RequestedChange& asked,
                                                    const ApiContext& front) {
  queue::JobChange change{asked.priority, asked.name, std::nullopt, asked.expires_at};
  if (asked.labels.empty()) return change;
  change.labels = merged(job, asked.labels);
  const std::size_t most = front.limits.document.labels;
  if (change.labels->size() <= most) return change;
  const std::string seen = std::to_string(change.labels->size());
  return Problem{
      Failure::bad_change,
      "1 error in the change",
      {{"/labels", "limit_exceeded", "the limit labels is " + std::to_string(most) + ", the job would have " + seen}}};
}

Problem problem_of(const queue::Job& job, queue::ChangeOutcome outcome) {
  switch (outcome) {
    case queue::ChangeOutcome::other_revision:
      return {Failure::revision_differs, "job " + job.id + " is not as If-Match names it", {}};
    case queue::ChangeOutcome::ended:
      return {Failure::job_ended, "job " + job.id + " has ended; its priority cannot be changed", {}};
    case queue::ChangeOutcome::expired:
      return {Failure::job_expired, "job " + job.id + " has expired; expires_at cannot be changed", {}};
    case queue::ChangeOutcome::changed:
    case queue::ChangeOutcome::unknown:
      break;
  }
  return no_such_job(job.id);
}

/// Tries until no other change comes between what was read and what is written; once, where a revision was asked for.
Answer make_change(const Request& request, const ApiContext& front, const api::RequestedChange& asked,
                   std::optional<std::int64_t> revision) {
  for (int tried = 1;; ++tried) {
    const auto view = find_job(request, front);
    if (!view) return problem_reply(view.error(), request.id);
    const queue::Job& job = view->job;
    const auto change = change_of(job, asked, front);
    if (!change) return problem_reply(change.error(), request.id);
    const auto outcome = front.queue.lifecycle.change(job.id, *change, revision.value_or(job.revision));
    if (outcome == queue::ChangeOutcome::changed) break;
    if (outcome == queue::ChangeOutcome::other_revision && !revision && tried < tries_max) continue;
    return problem_reply(problem_of(job, outcome), request.id);
  }
  const auto after = find_job(request, front);
  if (!after) return problem_reply(after.error(), request.id);
  Reply reply = job_reply(200, *after, front);
  reply.headers.emplace_back("ETag", etag_of(*after));
  return reply;
}

}  // namespace

Answer change_job(Request& request, const ApiContext& front) {
  const auto view = find_job(request, front);
  if (!view) return problem_reply(view.error(), request.id);
  const auto revision = revision_asked_for(request);
  if (!revision) return problem_reply(revision.error(), request.id);
  const auto body = take_json(request, "a change");
  if (!body) return problem_reply(body.error(), request.id);
  const auto asked = api::parse_change(*body, front.limits);
  if (!asked) {
    Problem problem = http::problem_of(asked.error());
    if (problem.failure == Failure::bad_scene) {
      problem.failure = Failure::bad_change;
      problem.detail = std::to_string(problem.errors.size()) + (problem.errors.size() == 1 ? " error" : " errors") +
                       " in the change";
    }
    return problem_reply(problem, request.id);
  }
  return make_change(request, front, *asked, *revision);
}

Answer retry_job(Request& request, const ApiContext& front) {
  const auto view = find_job(request, front);
  if (!view) return problem_reply(view.error(), request.id);
  if (front.draining())
    return problem_reply({Failure::draining, "nothing was changed; try again later", {}}, request.id);
  const std::string& id = view->job.id;
  switch (front.queue.lifecycle.retry(id)) {
    case queue::RetryOutcome::not_ended:
    case queue::RetryOutcome::succeeded:
      return problem_reply({Failure::job_not_failed, "only a job that failed or was cancelled can be tried again", {}},
                           request.id);
    case queue::RetryOutcome::expired:
      return problem_reply({Failure::job_expired, "the document of job " + id + " is gone; submit it again", {}},
                           request.id);
    case queue::RetryOutcome::unknown:
      return problem_reply(no_such_job(id), request.id);
    case queue::RetryOutcome::queued:
      break;
  }
  const auto after = front.queue.queries.find(id);
  if (!after) return problem_reply(no_such_job(id), request.id);
  return job_reply(202, *after, front);
}

Answer get_queue(Request&, const ApiContext& front) {
  Reply reply;
  reply.content_type = "application/json";
  reply.body = resources::write_queue(front.queue.queries.state());
  reply.headers.emplace_back("Cache-Control", "no-cache");
  return reply;
}

}  // namespace http
