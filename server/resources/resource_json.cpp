#include "server/resources/resource_json.h"

#include <algorithm>
#include <cmath>

#include "api/json.h"
#include "server/support/text_values.h"

namespace resources {
namespace {

using api::array_of, api::issues_json, api::Json, api::json_line, api::or_null, api::text_or_null;

Json time_json(std::optional<std::int64_t> unix_ms) { return unix_ms ? Json(time_text(*unix_ms)) : Json(nullptr); }

Json limits_json(const std::vector<std::pair<std::string, std::uint64_t>>& limits) {
  Json json = Json::object();
  for (const auto& [name, value] : limits) json[name] = value;
  return json;
}

double to_milliseconds(double seconds) { return std::round(seconds * 1000) / 1000; }

Json eta_json(const queue::JobView& view, std::int64_t now_ms) {
  if (view.waiting_eta_s) return to_milliseconds(*view.waiting_eta_s);
  if (view.job.state != queue::JobState::running || !view.job.started_at || view.progress < 0.01) return nullptr;
  const double so_far_s = static_cast<double>(std::max<std::int64_t>(now_ms - *view.job.started_at, 0)) / 1000;
  return to_milliseconds(so_far_s * (1 - view.progress) / view.progress);
}

Json job_problem_json(const std::optional<queue::Problem>& problem) {
  if (!problem) return nullptr;
  return {{"code", problem->code}, {"detail", problem->detail}, {"errors", issues_json(problem->errors)}};
}

/// JSON that was stored with a job. Null if it is not valid, as after a change of the format.
Json stored_json(const std::string& stored) {
  if (stored.empty()) return nullptr;
  Json json = Json::parse(stored, nullptr, false);
  return json.is_discarded() ? Json(nullptr) : json;
}

bool may_be_retried(const queue::Job& job) {
  return queue::ended(job.state) && job.state != queue::JobState::succeeded && !job.expired;
}

/// Null if the job has no artifact of that name yet.
Json link_to(const queue::Job& job, const std::string& name) {
  for (const queue::Artifact& artifact : job.artifacts) {
    if (artifact.name == name) return "/v1/jobs/" + job.id + "/" + name;
  }
  return nullptr;
}

Json first_image(const queue::Job& job) {
  const bool rendered = job.state == queue::JobState::succeeded && !job.artifacts.empty();
  return rendered ? link_to(job, job.artifacts.front().name) : Json(nullptr);
}

Json variation_json(const queue::Job& job) {
  if (job.batch.empty()) return nullptr;
  return {{"index", job.batch_index}, {"values", stored_json(job.variation)}};
}

Json job_json(const queue::JobView& view, std::int64_t now_ms) {
  const queue::Job& job = view.job;
  const std::string self = "/v1/jobs/" + job.id;
  const auto artifact_json = [&](const queue::Artifact& artifact) -> Json {
    return {{"name", artifact.name},
            {"media_type", artifact.media_type},
            {"bytes", artifact.bytes},
            {"sha256", artifact.sha256},
            {"url", self + "/" + artifact.name}};
  };
  const bool measured = job.kind == queue::JobKind::measure;
  return {{"id", job.id},
          {"kind", queue::name_of(job.kind)},
          {"name", job.name},
          {"state", queue::name_of(job.state)},
          {"progress", view.progress},
          {"eta_s", eta_json(view, now_ms)},
          {"queue_position", or_null(view.queue_position)},
          {"created_at", time_json(job.created_at)},
          {"started_at", time_json(job.started_at)},
          {"ended_at", time_json(job.ended_at)},
          {"run_after", time_json(job.run_after)},
          {"not_before", time_json(job.not_before)},
          {"deadline", time_json(job.deadline)},
          {"expires_at", time_json(job.expires_at)},
          {"expired", job.expired},
          {"keep", job.keep},
          {"attempt", job.attempt},
          {"max_attempts", job.max_attempts},
          {"priority", job.priority},
          {"cancel_requested", job.cancel_requested},
          {"labels", job.labels},
          {"owner", text_or_null(job.owner)},
          {"batch", text_or_null(job.batch)},
          {"variation", variation_json(job)},
          {"image", {{"width", job.width}, {"height", job.height}}},
          {"accuracy", stored_json(job.accuracy)},
          {"report", stored_json(measured ? std::string() : job.report)},
          {"measurement", stored_json(measured ? job.report + view.measurement : std::string())},  // one is empty
          {"problem", job_problem_json(job.problem)},
          {"artifacts", array_of(job.artifacts, artifact_json)},
          {"links",
           {{"self", self},
            {"cancel", queue::ended(job.state) ? Json(nullptr) : Json(self + "/cancel")},
            {"retry", may_be_retried(job) ? Json(self + "/retry") : Json(nullptr)},
            {"events", self + "/events"},
            {"preview", self + "/preview"},
            {"scene", job.expired ? Json(nullptr) : Json(self + "/scene")},
            {"image", measured ? link_to(job, "measure.png") : first_image(job)},
            {"measurement", measured ? link_to(job, "measure.json") : Json(nullptr)}}}};
}

Json attempt_json(const queue::DeliveryAttempt& attempt) {
  return {{"at", time_json(attempt.at)},
          {"duration_ms", attempt.duration_ms},
          {"status", attempt.status == 0 ? Json(nullptr) : Json(attempt.status)},
          {"detail", attempt.detail}};
}

Json json_of(const queue::Delivery& delivery) {
  return {{"id", delivery.id},
          {"event", delivery.event},
          {"url", delivery.url},
          {"state", queue::name_of(delivery.state)},
          {"created_at", time_json(delivery.created_at)},
          {"next_attempt_at", time_json(delivery.next_attempt_at)},
          {"attempts", array_of(delivery.attempts, attempt_json)}};
}

Json json_of(const queue::JobMove& move) {
  return {{"at", time_json(move.at)}, {"state", queue::name_of(move.state)},
          {"attempt", move.attempt},  {"code", text_or_null(move.code)},
          {"detail", move.detail},    {"worker", text_or_null(move.worker)}};
}

Json json_of(const queue::JobEvent& event) {
  return {{"id", event.job.id},
          {"state", event.state},
          {"progress", event.progress},
          {"at", time_json(event.at)},
          {"kind", queue::name_of(event.job.kind)},
          {"name", event.job.name},
          {"batch", text_or_null(event.job.batch)},
          {"owner", text_or_null(event.job.owner)}};
}

/// The state is queued or running until every job has ended; then failed or cancelled if a job is, else succeeded.
/// Progress is the share of ended jobs.
Json json_of(const queue::BatchState& state) {
  using enum queue::JobState;
  Json by_state = Json::object();
  std::int64_t all = 0, ended = 0;
  for (const queue::JobState which : queue::all_job_states) {
    by_state[queue::name_of(which)] = state.count(which);
    all += state.count(which);
    if (queue::ended(which)) ended += state.count(which);
  }
  const queue::JobState batch_state = ended < all                  ? (state.count(queued) == all ? queued : running)
                                      : state.count(failed) > 0    ? failed
                                      : state.count(cancelled) > 0 ? cancelled
                                                                   : succeeded;
  const queue::Batch& batch = state.batch;
  const std::string self = "/v1/batches/" + batch.id;
  const bool may_retry = state.count(failed) + state.count(cancelled) > 0;
  return {{"id", batch.id},
          {"name", batch.name},
          {"state", queue::name_of(batch_state)},
          {"progress", all == 0 ? 1.0 : static_cast<double>(ended) / static_cast<double>(all)},
          {"created_at", time_json(batch.created_at)},
          {"size", batch.size},
          {"jobs", std::move(by_state)},
          {"owner", text_or_null(batch.owner)},
          {"sweep", stored_json(batch.sweep)},
          {"max_failed", or_null(batch.max_failed)},
          {"links",
           {{"self", self},
            {"jobs", "/v1/jobs?batch=" + batch.id},
            {"cancel", ended < all ? Json(self + "/cancel") : Json(nullptr)},
            {"retry", may_retry ? Json(self + "/retry") : Json(nullptr)},
            {"artifacts", state.count(succeeded) > 0 ? Json(self + "/artifacts.tar") : Json(nullptr)}}}};
}

Json json_of(const queue::BatchPage& page) {
  Json items = array_of(page.items, [](const queue::BatchState& state) { return json_of(state); });
  return {{"items", std::move(items)}, {"next_cursor", text_or_null(page.next_cursor)}};
}

Json json_of(const queue::QueueState& state) {
  Json by_state = Json::object(), by_priority = Json::object();
  for (const auto& [which, count] : state.jobs) by_state[queue::name_of(which)] = count;
  for (const auto& [priority, count] : state.depth.queued_by_priority) by_priority[std::to_string(priority)] = count;
  return {{"jobs", std::move(by_state)},
          {"queued_by_priority", std::move(by_priority)},
          {"delayed", state.depth.delayed},
          {"running", state.jobs.at(queue::JobState::running)},
          {"oldest_age_s", or_null(state.oldest_age_s)},
          {"eta_s", state.eta_s ? Json(to_milliseconds(*state.eta_s)) : Json(nullptr)}};
}

Json json_of(const queue::Node& node) {
  return {{"id", node.id},
          {"name", node.name},
          {"role", node.role},
          {"version", node.version},
          {"slots", node.slots},
          {"running", node.running},
          {"started_at", time_text(node.started_at)},
          {"seen_at", time_text(node.seen_at)}};
}

Json json_of(const ProblemReply& problem) {
  Json json{{"type", problem.type},
            {"title", problem.title},
            {"status", problem.status},
            {"detail", problem.detail},
            {"request_id", problem.request_id}};
  if (!problem.errors.empty()) json["errors"] = issues_json(problem.errors);
  return json;
}

Json workers_json(const ServiceStatus& status) {
  const telemetry::GaugeValues& now = status.gauges;
  if (now.worker_pid == 0) return Json::array();
  return Json::array({{{"pid", now.worker_pid},
                       {"jobs", now.worker_jobs},
                       {"places", now.worker_slots},
                       {"rss_bytes", or_null(now.worker_rss_bytes)},
                       {"sandbox", text_or_null(status.sandbox)}}});
}

Json history_json(const telemetry::ServiceHistory::Hour& hour) {
  using Step = telemetry::ServiceHistory::Step;
  const auto series = [&](auto member) {
    return array_of(hour.steps, [&](const Step& step) {
      if constexpr (requires { (step.*member).has_value(); })
        return or_null(step.*member);
      else
        return Json(step.*member);
    });
  };
  return {{"step_s", telemetry::ServiceHistory::step_ms / 1000},
          {"until", hour.until == 0 ? Json(nullptr) : Json(time_text(hour.until))},
          {"queued", series(&Step::queued)},
          {"running", series(&Step::running)},
          {"ended", series(&Step::ended)},
          {"failed", series(&Step::failed)},
          {"wait_p50_ms", series(&Step::wait_p50_ms)},
          {"wait_p95_ms", series(&Step::wait_p95_ms)},
          {"rays", series(&Step::rays)},
          {"rss_bytes", series(&Step::rss_bytes)}};
}

Json json_of(const ServiceStatus& status) {
  const telemetry::GaugeValues& now = status.gauges;
  Json limits = limits_json(status.limits);
  limits["artifact_bytes"] = now.artifact_bytes_max;
  return {{"ready", status.not_ready.empty()},
          {"reason", status.not_ready},
          {"draining", status.draining},
          {"workers", workers_json(status)},
          {"disk", {{"free_bytes", now.disk_space.free_bytes}, {"reserve_bytes", now.disk_space.reserve_bytes}}},
          {"memory", {{"rss_bytes", or_null(now.rss_bytes)}}},
          {"caches", {{"geometry_bytes", now.cache_geometry_bytes}, {"image_bytes", now.cache_image_bytes}}},
          {"queue", json_of(status.queue)},
          {"streams", {{"open", now.event_listeners}, {"limit", status.streams_max}}},
          {"version", {{"version", now.version}, {"build", now.build}}},
          {"limits", std::move(limits)},
          {"used",
           {{"queued_jobs", status.queue.jobs.at(queue::JobState::queued)},
            {"artifact_bytes", now.artifact_bytes},
            {"uploads_bytes", now.upload_bytes}}},
          {"history", status.hour ? history_json(*status.hour) : Json(nullptr)}};
}

template <class Item>
Json json_of(const std::vector<Item>& list) {
  return {{"items", array_of(list, [](const Item& item) { return json_of(item); })}};
}

}  // namespace

std::string time_text(std::int64_t unix_ms) {
  const std::string milliseconds = std::to_string(1000 + unix_ms % 1000).substr(1);
  return support::in_utc(unix_ms / 1000, "%Y-%m-%dT%H:%M:%S.") + milliseconds + 'Z';
}

std::string write_job(const queue::JobView& view, std::int64_t now_ms) { return json_line(job_json(view, now_ms)); }

std::string write_event(std::string_view event, const queue::JobView& view, std::int64_t now_ms) {
  return json_line({{"type", event}, {"timestamp", time_json(now_ms)}, {"data", job_json(view, now_ms)}});
}

std::string write_event(std::string_view event, std::int64_t now_ms) {
  return json_line({{"type", event}, {"timestamp", time_json(now_ms)}, {"data", Json::object()}});
}

std::string write_job_list(const std::vector<queue::JobView>& views, const std::string& next_cursor,
                           std::int64_t now_ms) {
  Json items = array_of(views, [&](const queue::JobView& view) { return job_json(view, now_ms); });
  return json_line({{"items", std::move(items)}, {"next_cursor", text_or_null(next_cursor)}});
}

std::string write_version(std::string_view version, std::string_view build, std::string_view sandbox, bool dashboard,
                          const std::vector<std::pair<std::string, std::uint64_t>>& limits) {
  return json_line({{"version", version},
                    {"build", build},
                    {"sandbox", text_or_null(std::string(sandbox))},
                    {"dashboard", dashboard},
                    {"limits", limits_json(limits)}});
}

template <class Resource>
std::string write(const Resource& resource) {
  return json_line(json_of(resource));
}

template std::string write(const queue::JobEvent&);
template std::string write(const std::vector<queue::Delivery>&);
template std::string write(const std::vector<queue::JobMove>&);
template std::string write(const std::vector<queue::Node>&);
template std::string write(const queue::BatchState&);
template std::string write(const queue::BatchPage&);
template std::string write(const queue::QueueState&);
template std::string write(const ServiceStatus&);
template std::string write(const ProblemReply&);

}  // namespace resources
