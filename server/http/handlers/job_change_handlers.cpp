/// Changes of a stored job: fields, cancellation, retry, removal.

#include "api/job_patch.h"
#include "server/http/handlers/handlers.h"
#include "server/http/header_text.h"

namespace http::handlers {
namespace {

/// Attempts to change a job that other changes modify at the same time, if the client accepts any revision.
constexpr int attempts_max = 16;

/// The labels of the job after the patch, which removes those without a value.
std::map<std::string, std::string> patched_labels(const queue::Job& job, const api::RequestedChange& patch) {
  std::map<std::string, std::string> labels = job.labels;
  for (const auto& [name, value] : patch.labels) {
    if (value) {
      labels.insert_or_assign(name, *value);
    } else {
      labels.erase(name);
    }
  }
  return labels;
}

Problem invalid_patch(std::vector<tracer::Issue> errors) {
  const std::string count = std::to_string(errors.size()) + (errors.size() == 1 ? " error" : " errors");
  return {failures::invalid_patch, count + " in the change", std::move(errors)};
}

tracer::Result<queue::JobChange, Problem> change_of(const queue::Job& job, const api::RequestedChange& patch,
                                                    const ApiContext& context) {
  queue::JobChange change{patch.priority, patch.name, std::nullopt, patch.expires_at};
  if (patch.labels.empty()) return change;
  change.labels = patched_labels(job, patch);
  const std::size_t limit = context.limits.document.labels;
  if (change.labels->size() <= limit) return change;
  return invalid_patch({{"/labels", "limit_exceeded",
                         "the limit labels is " + std::to_string(limit) + ", the job would have " +
                             std::to_string(change.labels->size())}});
}

Problem conflict_of(const queue::Job& job, queue::ChangeOutcome outcome) {
  switch (outcome) {
    case queue::ChangeOutcome::other_revision:
      return {failures::precondition_failed, "job " + job.id + " does not have the revision of If-Match"};
    case queue::ChangeOutcome::ended:
      return {failures::job_ended, "job " + job.id + " has ended; its priority cannot be changed"};
    case queue::ChangeOutcome::expired:
      return {failures::job_expired, "job " + job.id + " has expired; expires_at cannot be changed"};
    case queue::ChangeOutcome::changed:
    case queue::ChangeOutcome::unknown:
      break;
  }
  return job_not_found(job.id);
}

/// The revision in If-Match; nothing for "*". Problem: 428 without the header.
tracer::Result<std::optional<std::int64_t>, Problem> required_revision(const Request& request) {
  const auto header = request.head.header("if-match");
  if (!header) return Problem{failures::precondition_required, "send If-Match with the ETag of the job, or with *"};
  if (*header == "*") return std::optional<std::int64_t>();
  std::string_view etag = *header;
  if (etag.starts_with("W/")) etag.remove_prefix(2);
  const bool quoted = etag.starts_with('"') && etag.find('-') != std::string_view::npos;
  const auto revision = quoted ? parse_number<std::int64_t>(etag.substr(1, etag.find('-') - 1)) : std::nullopt;
  // An ETag of another resource is valid, but matches no job (RFC 9110, section 13.1.1).
  return std::optional(revision.value_or(-1));
}

/// Repeats the change while others come between reading and writing, unless a revision is required.
Answer apply_change(const std::string& id, const ApiContext& context, const api::RequestedChange& patch,
                    std::optional<std::int64_t> revision) {
  for (int attempt = 1;; ++attempt) {
    const auto view = find_job(id, context);
    if (!view) return view.error();
    const queue::Job& job = view->job;
    const auto change = change_of(job, patch, context);
    if (!change) return change.error();
    const auto outcome = context.queue.lifecycle.change(id, *change, revision.value_or(job.revision));
    if (outcome == queue::ChangeOutcome::changed) break;
    const bool conflict = outcome == queue::ChangeOutcome::other_revision && !revision;
    if (!conflict || attempt == attempts_max) return conflict_of(job, outcome);
  }
  const auto after = find_job(id, context);
  if (!after) return after.error();
  Reply reply = job_reply(200, *after, context);
  reply.headers.emplace_back("ETag", etag_of(*after));
  return reply;
}

}  // namespace

Answer change_job(Request& request, const ApiContext& context) {
  const auto view = find_job(request.parameters.front(), context);
  if (!view) return view.error();
  const auto revision = required_revision(request);
  if (!revision) return revision.error();
  const auto body = take_json(request, "a change");
  if (!body) return body.error();
  const auto patch = api::parse_change(*body, context.limits);
  if (patch) return apply_change(view->job.id, context, *patch, *revision);
  Problem problem = problem_of(patch.error());
  if (problem.failure == failures::bad_scene) return invalid_patch(std::move(problem.errors));
  return problem;
}

Answer cancel_job(Request& request, const ApiContext& context) {
  const std::string& id = request.parameters.front();
  if (const auto view = find_job(id, context); !view) return view.error();
  const queue::CancelOutcome outcome = context.queue.lifecycle.cancel(id);
  const auto after = find_job(id, context);
  if (!after) return after.error();
  if (outcome == queue::CancelOutcome::already_ended) {
    const std::string state = queue::name_of(after->job.state);
    return Problem{failures::job_ended, "job " + id + " has ended, it is " + state};
  }
  return job_reply(202, *after, context);
}

Answer retry_job(Request& request, const ApiContext& context) {
  const std::string& id = request.parameters.front();
  if (const auto view = find_job(id, context); !view) return view.error();
  if (auto problem = refuse_if_draining(context)) return *problem;
  switch (context.queue.lifecycle.retry(id)) {
    case queue::RetryOutcome::not_ended:
    case queue::RetryOutcome::succeeded:
      return Problem{failures::job_not_failed, "only a job that failed or was cancelled can be retried"};
    case queue::RetryOutcome::expired:
      return Problem{failures::job_expired, "the document of job " + id + " has expired; submit it again"};
    case queue::RetryOutcome::unknown:
      return job_not_found(id);
    case queue::RetryOutcome::queued:
      break;
  }
  return changed_job_reply(202, id, context);
}

Answer remove_job(Request& request, const ApiContext& context) {
  const std::string& id = request.parameters.front();
  if (const auto view = find_job(id, context); !view) return view.error();
  switch (context.queue.lifecycle.remove(id)) {
    case queue::RemoveOutcome::running:
      return Problem{failures::job_running, "job " + id + " is running; cancel it first"};
    case queue::RemoveOutcome::unknown:
      return job_not_found(id);
    case queue::RemoveOutcome::removed:
      break;
  }
  Reply reply;
  reply.status = 204;
  reply.job_id = id;
  return reply;
}

}  // namespace http::handlers
