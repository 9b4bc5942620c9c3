/// Submissions, validation, lists of jobs, and the state of the queue.

#include <utility>

#include "api/estimate.h"
#include "api/measure_request.h"
#include "api/report.h"
#include "api/validation_json.h"
#include "server/http/handlers/handlers.h"
#include "server/http/header_text.h"
#include "server/resources/resource_json.h"

namespace http::handlers {
namespace {

constexpr int list_default = 50, list_max = 200;  // 200 jobs are half a megabyte of JSON: some milliseconds

struct ListQuery {
  queue::JobFilter filter;
  std::string cursor;
  int limit = list_default;
};

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
    return is_id(value) ? "" : "batch must be the id of a batch";
  }
  if (name == "limit") {
    query.limit = parse_number<int>(value).value_or(0);
    return query.limit >= 1 && query.limit <= list_max ? "" : "limit must be 1.." + std::to_string(list_max);
  }
  if (name == "cursor") {
    query.cursor = value;
    return value.size() == 36 ? "" : "cursor must be a next_cursor";
  }
  query.filter.text = value;  // q
  return "";
}

/// Returns the errors of all parameters as one sentence; empty if there are none.
std::string read_list_query(const Pairs& pairs, ListQuery& query) {
  std::string errors;
  const auto add_error = [&](const std::string& error) {
    if (!error.empty()) errors += (errors.empty() ? "" : "; ") + error;
  };
  for (auto pair = pairs.begin(); pair != pairs.end(); ++pair) {
    const bool repeated =
        std::any_of(pairs.begin(), pair, [&](const auto& earlier) { return earlier.first == pair->first; });
    if (repeated && pair->first != "label") add_error(pair->first + " is given twice");
    add_error(read_list_parameter(pair->first, pair->second, query));
  }
  return errors;
}

tracer::Result<api::MeasureRequest, Problem> parse_measure(const std::string& body, const ApiContext& context) {
  auto parsed = api::parse_measure(body, context.limits);
  if (!parsed) return problem_of(parsed.error());
  const tracer::Scene& scene = parsed->document.scene;
  api::Refusal refusal;
  refusal.issues = deployment_issues(scene, api::estimated_measure_memory_bytes(scene), context);
  for (tracer::Issue& issue : refusal.issues) issue.pointer.insert(0, "/scene");
  if (!refusal.issues.empty()) return problem_of(refusal);
  return std::move(*parsed);
}

Answer submit_and_reply(const Request& request, queue::Submission submission, const ApiContext& context) {
  const auto submitted = submit(request, std::move(submission), context);
  if (!submitted) return submitted.error();
  return submission_reply(request, *submitted, context);
}

}  // namespace

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
  queue::Submission submission;
  submission.kind = queue::JobKind::measure;
  submission.owner = request.owner;
  submission.accuracy = api::write_accuracy(measurement->document.scene.accuracy);
  submission.document = std::move(*body);
  submission.parsed = std::move(measurement->document);
  return submit_and_reply(request, std::move(submission), context);
}

Answer validate_job(Request& request, const ApiContext& context) {
  const auto scene = take_scene(request, context);
  if (scene) return json_reply(200, api::write_valid(scene->parsed.scene, context.seconds_per_work()));
  if (scene.error().failure != failures::bad_scene) return scene.error();
  return json_reply(200, api::write_invalid(scene.error().errors));
}

Answer list_jobs(Request& request, const ApiContext& context) {
  ListQuery query;
  const std::string errors = read_list_query(request.head.query, query);
  if (!errors.empty()) return Problem{failures::invalid_query, errors};
  queue::JobPage page = context.queue.queries.list(query.filter, query.cursor, query.limit);
  std::vector<queue::JobView> views;
  views.reserve(page.items.size());
  for (queue::Job& job : page.items) {
    const double progress = job.state == queue::JobState::succeeded ? 1 : context.queue.queries.progress(job.id);
    views.push_back({std::move(job), progress});
  }
  return json_reply(200, resources::write_job_list(views, page.next_cursor, context.clock()));
}

Answer get_deliveries(Request& request, const ApiContext& context) {
  const auto view = find_job(request.parameters.front(), context);
  if (!view) return view.error();
  Reply reply = json_reply(200, resources::write_deliveries(context.deliveries(view->job.id)));
  reply.job_id = view->job.id;
  return reply;
}

Answer get_queue(Request&, const ApiContext& context) {
  Reply reply = json_reply(200, resources::write_queue(context.queue.queries.state()));
  reply.headers.emplace_back("Cache-Control", "no-cache");
  return reply;
}

}  // namespace http::handlers
