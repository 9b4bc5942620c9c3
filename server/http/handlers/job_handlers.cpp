/// Jobs: submission, validation, lists, changes, cancellation, retry, removal; and the state of the queue.

#include <utility>

#include "api/estimate.h"
#include "api/measure_request.h"
#include "api/reader/fields.h"
#include "api/report.h"
#include "server/http/handlers/handlers.h"
#include "server/http/header_text.h"
#include "server/resources/resource_json.h"

namespace http::handlers {
namespace {

constexpr int list_max = 200;  // 200 jobs are half a megabyte of JSON: some milliseconds

/// Reads a "label" parameter into the filter; returns the error, or nothing.
std::string read_label(const std::string& value, queue::JobFilter& filter) {
  const std::size_t colon = value.find(':');
  if (colon == 0 || colon == std::string::npos) return "label must be NAME:VALUE";
  const bool is_new = filter.labels.emplace(value.substr(0, colon), value.substr(colon + 1)).second;
  return is_new ? "" : "label " + value.substr(0, colon) + " is given twice";
}

/// Reads one parameter; returns the error, or nothing.
std::string read_list_parameter(const std::string& name, const std::string& value, ListQuery& query) {
  if (name == "label") return read_label(value, query.filter);
  if (name == "state") {
    query.filter.state = queue::job_state(value);
    return query.filter.state ? "" : "state must be queued, running, succeeded, failed or cancelled";
  }
  if (name == "batch") {
    query.filter.batch = value;
    return is_id(value) || value == "none" ? "" : "batch must be the id of a batch, or none";
  }
  if (name == "kind") {
    query.filter.kind = queue::job_kind(value);
    return query.filter.kind ? "" : "kind must be render or measure";
  }
  if (name == "created_after" || name == "created_before") {
    auto& moment = name == "created_after" ? query.filter.created_after : query.filter.created_before;
    moment = api::parse_time(value);
    return moment ? "" : name + " must be a time such as 2030-01-31T18:00:00Z";
  }
  if (name == "limit") {
    query.limit = parse_number<int>(value).value_or(0);
    return query.limit >= 1 && query.limit <= list_max ? "" : "limit must be 1.." + std::to_string(list_max);
  }
  if (name == "cursor") {
    query.cursor = value;
    return value.size() == 36 ? "" : "cursor must be a next_cursor";
  }
  if (name == "owner") query.filter.owner = value;
  if (name == "q") query.filter.text = value;
  return "";
}

tracer::Result<api::MeasureRequest, Problem> parse_measure(const std::string& body, const ApiContext& context) {
  auto parsed = api::parse_measure(body, context.limits);
  if (!parsed) return problem_of(parsed.error());
  const tracer::Scene& scene = parsed->document.scene;
  const std::uint64_t memory_bytes = api::estimated_measure_memory_bytes(*parsed);
  if (auto problem = deployment_problem(scene, memory_bytes, "/scene", context)) return *std::move(problem);
  return std::move(*parsed);
}

Answer submit_and_reply(const Request& request, queue::Submission submission, const ApiContext& context) {
  const auto submitted = submit(request, std::move(submission), context);
  if (!submitted) return submitted.error();
  return submission_reply(request, *submitted, context);
}

/// Attempts to change a job that other changes modify at the same time, if the client accepts any revision.
constexpr int attempts_max = 16;

/// A JSON merge patch (RFC 7396) of a job: {priority, name, labels{NAME: VALUE|null}, expires_at|null}, each optional.
/// Unset: unchanged.
struct RequestedChange {
  std::optional<int> priority;  ///< 0..100
  std::optional<std::string> name;
  std::map<std::string, std::optional<std::string>> labels;  ///< null: removed; labels that are not named are kept
  std::optional<std::optional<std::int64_t>> expires_at;     ///< ms since 1970 UTC; null: never
};

void read_change(api::Reading& reading, RequestedChange& change) {
  api::Fields fields(reading, reading.root, "a change of a job");
  fields.optional("priority", api::Integer<std::optional<int>>{change.priority, 0, 100});
  fields.optional("name", change.name);
  if (const auto labels = fields.take("labels")) read_labels(reading, *labels, true, change.labels);
  if (const auto expires_at = fields.take("expires_at")) {
    std::optional<std::int64_t> time;
    const bool never = expires_at->node->kind == api::json::Kind::null;
    if (never || read(reading, *expires_at, api::Time{time})) change.expires_at = time;
  }
  fields.finish();
}

/// The labels of the job after the patch, which removes those without a value.
std::map<std::string, std::string> patched_labels(const queue::Job& job, const RequestedChange& patch) {
  std::map<std::string, std::string> labels = job.labels;
  for (const auto& [name, value] : patch.labels) {
    labels.erase(name);
    if (value) labels.emplace(name, *value);
  }
  return labels;
}

Problem invalid_patch(std::vector<tracer::Issue> errors) {
  return with_errors(failures::invalid_patch, "in the change", std::move(errors));
}

tracer::Result<queue::JobChange, Problem> change_of(const queue::Job& job, const RequestedChange& patch,
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

Problem change_problem(const queue::Job& job, queue::ChangeOutcome outcome) {
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
Answer apply_change(const std::string& id, const ApiContext& context, const RequestedChange& patch,
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
    if (!conflict || attempt == attempts_max) return change_problem(job, outcome);
  }
  const auto after = find_job(id, context);
  if (!after) return after.error();
  Reply reply = job_reply(200, *after, context);
  reply.headers.emplace_back("ETag", etag_of(*after));
  return reply;
}

Answer submit_job(Request& request, const ApiContext& context) {
  if (auto problem = refuse_if_draining(context)) return *problem;
  auto scene = take_scene(request, context);
  if (!scene) return scene.error();
  return submit_and_reply(request, submission_of(request, std::move(*scene), context), context);
}

/// Measurements have no content key, because seconds depend on the machine and its load.
Answer measure(Request& request, const ApiContext& context) {
  if (auto problem = refuse_if_draining(context)) return *problem;
  auto body = take_json(request, "a measurement");
  if (!body) return body.error();
  auto measurement = parse_measure(*body, context);
  if (!measurement) return measurement.error();
  queue::Submission submission =
      submission_of(request, measurement->document.scene, std::move(measurement->document.job));
  submission.job.kind = queue::JobKind::measure;
  submission.job.large = true;
  submission.job.work = queue::work_of(api::estimated_measure_work(*measurement));
  submission.document = std::move(*body);
  return submit_and_reply(request, std::move(submission), context);
}

Answer validate_job(Request& request, const ApiContext& context) {
  const auto scene = take_scene(request, context);
  if (scene) return json_reply(200, api::write_valid(scene->parsed.scene, context.queue.queries.seconds_per_work()));
  if (scene.error().failure != failures::bad_scene) return scene.error();
  return json_reply(200, api::write_invalid(scene.error().errors));
}

Answer list_jobs(Request& request, const ApiContext& context) {
  const auto query = read_list_query(request.head.query);
  if (!query) return query.error();
  queue::JobPage page = context.queue.queries.list(query->filter, query->cursor, query->limit);
  std::vector<queue::JobView> views;
  views.reserve(page.items.size());
  for (queue::Job& job : page.items) {
    const double progress = job.state == queue::JobState::succeeded ? 1 : context.queue.queries.progress(job.id);
    views.push_back({std::move(job), progress});
  }
  return json_reply(200, resources::write_job_list(views, page.next_cursor, context.clock()));
}

/// The document as submitted; of a job of a batch, its scene with the patch applied.
Answer get_scene(Request&, const queue::JobView& view, const ApiContext& context) {
  auto document = context.queue.queries.document(view.job.id);
  if (!document) return Problem{failures::job_expired, "the document of job " + view.job.id + " has expired"};
  return json_reply(200, *std::move(document));
}

Answer get_history(Request&, const queue::JobView& view, const ApiContext& context) {
  const queue::Job& job = view.job;
  std::vector<queue::JobMove> moves = context.queue.queries.moves(job.id);
  const bool from_cache = moves.empty() && job.state == queue::JobState::succeeded;
  if (job.keep && moves.size() < queue::moves_max)
    moves.insert(moves.begin(), {job.created_at, from_cache ? job.state : queue::JobState::queued, 0, "", "", ""});
  return json_reply(200, resources::write(moves), "no-cache");
}

Answer get_queue(Request&, const ApiContext& context) {
  return json_reply(200, resources::write(context.queue.queries.state()), "no-cache");
}

Answer change_job(Request& request, const queue::JobView& view, const ApiContext& context) {
  const auto revision = required_revision(request);
  if (!revision) return revision.error();
  const auto body = take_json(request, "a change", "application/merge-patch+json");
  if (!body) return body.error();
  const auto patch = api::read_body<RequestedChange>(*body, context.limits, read_change);
  if (patch) return apply_change(view.job.id, context, *patch, *revision);
  Problem problem = problem_of(patch.error());
  if (problem.failure == failures::bad_scene) return invalid_patch(std::move(problem.errors));
  return problem;
}

Answer cancel_job(Request&, const queue::JobView& view, const ApiContext& context) {
  const std::string& id = view.job.id;
  const queue::CancelOutcome outcome = context.queue.lifecycle.cancel(id);
  const auto after = find_job(id, context);
  if (!after) return after.error();
  if (outcome == queue::CancelOutcome::already_ended) {
    const std::string state = queue::name_of(after->job.state);
    return Problem{failures::job_ended, "job " + id + " has ended, it is " + state};
  }
  return job_reply(202, *after, context);
}

Answer retry_job(Request&, const queue::JobView& view, const ApiContext& context) {
  const std::string& id = view.job.id;
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
  const auto after = find_job(id, context);
  if (!after) return after.error();
  return job_reply(202, *after, context);
}

Answer remove_job(Request&, const queue::JobView& view, const ApiContext& context) {
  const std::string& id = view.job.id;
  switch (context.queue.lifecycle.remove(id)) {
    case queue::RemoveOutcome::running:
      return Problem{failures::job_running, "job " + id + " is running; cancel it first"};
    case queue::RemoveOutcome::unknown:
      return job_not_found(id);
    case queue::RemoveOutcome::removed:
      break;
  }
  return Reply{.status = 204};
}

}  // namespace

tracer::Result<ListQuery, Problem> read_list_query(const Pairs& pairs) {
  ListQuery query;
  std::string errors;
  for (const auto& [name, value] : pairs) {
    const std::string error = read_list_parameter(name, value, query);
    if (!error.empty()) errors += (errors.empty() ? "" : "; ") + error;
  }
  if (!errors.empty()) return Problem{failures::invalid_query, errors};
  return query;
}

Endpoints job_endpoints() {
  return {{"POST", "/v1/jobs", submit_job},
          {"GET",
           "/v1/jobs",
           list_jobs,
           {.query = {"state", "label", "batch", "kind", "owner", "created_after", "created_before", "q", "limit",
                      "cursor"}}},
          {"POST", "/v1/jobs/validate", validate_job},
          {"POST", "/v1/measure", measure},
          {"GET", "/v1/jobs/{id}/scene", get_scene},
          {"GET", "/v1/jobs/{id}/history", get_history},
          {"PATCH", "/v1/jobs/{id}", change_job},
          {"DELETE", "/v1/jobs/{id}", remove_job},
          {"POST", "/v1/jobs/{id}/cancel", cancel_job},
          {"POST", "/v1/jobs/{id}/retry", retry_job},
          {"GET", "/v1/queue", get_queue}};
}

}  // namespace http::handlers
