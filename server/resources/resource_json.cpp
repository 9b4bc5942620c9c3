#include "server/resources/resource_json.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>

#include "api/report.h"

namespace resources {
namespace {

using Json = nlohmann::ordered_json;

/// The text on one line with a newline at its end. Invalid UTF-8 is replaced by U+FFFD.
std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n'; }

Json time_json(std::optional<std::int64_t> unix_ms) { return unix_ms ? Json(time_text(*unix_ms)) : Json(nullptr); }

/// [{pointer, code, detail}] with pointers as URI fragments.
Json errors_json(const std::vector<tracer::Issue>& errors) {
  Json list = Json::array();
  for (const tracer::Issue& issue : errors) {
    list.push_back({{"pointer", api::uri_fragment(issue.pointer)}, {"code", issue.code}, {"detail", issue.detail}});
  }
  return list;
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
  return {{"code", problem->code}, {"detail", problem->detail}, {"errors", errors_json(problem->errors)}};
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

Json text_or_null(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }

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
  Json artifacts = Json::array();
  for (const queue::Artifact& artifact : job.artifacts) {
    artifacts.push_back({{"name", artifact.name},
                         {"media_type", artifact.media_type},
                         {"bytes", artifact.bytes},
                         {"sha256", artifact.sha256},
                         {"url", self + "/" + artifact.name}});
  }
  const bool measured = job.kind == queue::JobKind::measure;
  Json labels = Json::object();
  for (const auto& [name, value] : job.labels) labels[name] = value;
  return {{"id", job.id},
          {"kind", queue::name_of(job.kind)},
          {"name", job.name},
          {"state", queue::name_of(job.state)},
          {"progress", view.progress},
          {"eta_s", eta_json(view, now_ms)},
          {"queue_position", view.queue_position ? Json(*view.queue_position) : Json(nullptr)},
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
          {"labels", std::move(labels)},
          {"owner", text_or_null(job.owner)},
          {"batch", text_or_null(job.batch)},
          {"variation", variation_json(job)},
          {"image", {{"width", job.width}, {"height", job.height}}},
          {"accuracy", stored_json(job.accuracy)},
          {"report", stored_json(measured ? std::string() : job.report)},
          {"measurement", stored_json(measured ? job.report + view.measurement : std::string())},  // one is empty
          {"problem", job_problem_json(job.problem)},
          {"artifacts", std::move(artifacts)},
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

}  // namespace

std::string time_text(std::int64_t unix_ms) {
  const std::time_t seconds = unix_ms / 1000;
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  std::array<char, 24> date{};
  std::strftime(date.data(), date.size(), "%Y-%m-%dT%H:%M:%S", &utc);
  std::array<char, 8> fraction{};
  std::snprintf(fraction.data(), fraction.size(), ".%03dZ", static_cast<int>(unix_ms % 1000));
  return std::string(date.data()) + fraction.data();
}

std::string write_job(const queue::JobView& view, std::int64_t now_ms) { return text_of(job_json(view, now_ms)); }

std::string write_event(std::string_view event, const queue::JobView& view, std::int64_t now_ms) {
  return text_of({{"type", event}, {"timestamp", time_json(now_ms)}, {"data", job_json(view, now_ms)}});
}

std::string write_event(std::string_view event, std::int64_t now_ms) {
  return text_of({{"type", event}, {"timestamp", time_json(now_ms)}, {"data", Json::object()}});
}

std::string write_deliveries(const std::vector<queue::Delivery>& deliveries) {
  Json items = Json::array();
  for (const queue::Delivery& delivery : deliveries) {
    Json attempts = Json::array();
    for (const queue::DeliveryAttempt& attempt : delivery.attempts) {
      attempts.push_back({{"at", time_json(attempt.at)},
                          {"duration_ms", attempt.duration_ms},
                          {"status", attempt.status == 0 ? Json(nullptr) : Json(attempt.status)},
                          {"detail", attempt.detail}});
    }
    items.push_back({{"id", delivery.id},
                     {"event", delivery.event},
                     {"url", delivery.url},
                     {"state", queue::name_of(delivery.state)},
                     {"created_at", time_json(delivery.created_at)},
                     {"next_attempt_at", time_json(delivery.next_attempt_at)},
                     {"attempts", std::move(attempts)}});
  }
  return text_of({{"items", std::move(items)}});
}

std::string write_history(const std::vector<queue::JobMove>& moves) {
  Json items = Json::array();
  for (const queue::JobMove& move : moves) {
    items.push_back({{"at", time_json(move.at)},
                     {"state", queue::name_of(move.state)},
                     {"attempt", move.attempt},
                     {"code", text_or_null(move.code)},
                     {"detail", move.detail},
                     {"worker", text_or_null(move.worker)}});
  }
  return text_of({{"items", std::move(items)}});
}

std::string write_job_list(const std::vector<queue::JobView>& views, const std::string& next_cursor,
                           std::int64_t now_ms) {
  Json items = Json::array();
  for (const queue::JobView& view : views) items.push_back(job_json(view, now_ms));
  Json cursor = next_cursor.empty() ? Json(nullptr) : Json(next_cursor);
  return text_of({{"items", std::move(items)}, {"next_cursor", std::move(cursor)}});
}

std::string write_event(const queue::JobEvent& event) {
  return text_of({{"id", event.job.id},
                  {"state", event.state},
                  {"progress", event.progress},
                  {"at", time_json(event.at)},
                  {"kind", queue::name_of(event.job.kind)},
                  {"name", event.job.name},
                  {"batch", text_or_null(event.job.batch)},
                  {"owner", text_or_null(event.job.owner)}});
}

static Json batch_json(const queue::BatchState& state) {
  using enum queue::JobState;
  const auto count = [&](queue::JobState which) {
    const auto found = state.jobs.find(which);
    return found == state.jobs.end() ? 0 : found->second;
  };
  Json by_state = Json::object();
  std::int64_t all = 0, ended = 0;
  for (const queue::JobState which : queue::all_job_states) {
    by_state[queue::name_of(which)] = count(which);
    all += count(which);
    if (queue::ended(which)) ended += count(which);
  }
  const queue::JobState batch_state = ended < all            ? (count(queued) == all ? queued : running)
                                      : count(failed) > 0    ? failed
                                      : count(cancelled) > 0 ? cancelled
                                                             : succeeded;
  const queue::Batch& batch = state.batch;
  const std::string self = "/v1/batches/" + batch.id;
  const bool may_retry = count(failed) + count(cancelled) > 0;
  return {{"id", batch.id},
          {"name", batch.name},
          {"state", queue::name_of(batch_state)},
          {"progress", all == 0 ? 1.0 : static_cast<double>(ended) / static_cast<double>(all)},
          {"created_at", time_json(batch.created_at)},
          {"size", batch.size},
          {"jobs", std::move(by_state)},
          {"owner", text_or_null(batch.owner)},
          {"sweep", stored_json(batch.sweep)},
          {"max_failed", batch.max_failed ? Json(*batch.max_failed) : Json(nullptr)},
          {"links",
           {{"self", self},
            {"jobs", "/v1/jobs?batch=" + batch.id},
            {"cancel", ended < all ? Json(self + "/cancel") : Json(nullptr)},
            {"retry", may_retry ? Json(self + "/retry") : Json(nullptr)},
            {"artifacts", count(succeeded) > 0 ? Json(self + "/artifacts.tar") : Json(nullptr)}}}};
}

std::string write_batch(const queue::BatchState& state) { return text_of(batch_json(state)); }

std::string write_batch_list(const queue::BatchPage& page) {
  Json items = Json::array();
  for (const queue::BatchState& state : page.items) items.push_back(batch_json(state));
  return text_of({{"items", std::move(items)},
                  {"next_cursor", page.next_cursor.empty() ? Json(nullptr) : Json(page.next_cursor)}});
}

std::string write_queue(const queue::QueueState& state) {
  Json by_state = Json::object(), by_priority = Json::object();
  for (const auto& [which, count] : state.jobs) by_state[queue::name_of(which)] = count;
  for (const auto& [priority, count] : state.depth.queued_by_priority) by_priority[std::to_string(priority)] = count;
  return text_of({{"jobs", std::move(by_state)},
                  {"queued_by_priority", std::move(by_priority)},
                  {"delayed", state.depth.delayed},
                  {"running", state.jobs.at(queue::JobState::running)},
                  {"oldest_age_s", state.oldest_age_s ? Json(*state.oldest_age_s) : Json(nullptr)},
                  {"eta_s", state.eta_s ? Json(to_milliseconds(*state.eta_s)) : Json(nullptr)}});
}

std::string write_nodes(const std::vector<queue::Node>& nodes) {
  Json items = Json::array();
  for (const queue::Node& node : nodes) {
    items.push_back({{"id", node.id},
                     {"name", node.name},
                     {"role", node.role},
                     {"version", node.version},
                     {"slots", node.slots},
                     {"running", node.running},
                     {"started_at", time_text(node.started_at)},
                     {"seen_at", time_text(node.seen_at)}});
  }
  return text_of({{"items", std::move(items)}});
}

std::string write_me(const std::string& name, const std::vector<std::string_view>& scopes,
                     const queue::OwnerUsage& quotas, const queue::OwnerUsage& used) {
  const auto usage_json = [](const queue::OwnerUsage& usage) -> Json {
    return {{"queued_jobs", usage.queued_jobs}, {"artifact_bytes", usage.artifact_bytes}};
  };
  return text_of(
      {{"name", text_or_null(name)}, {"scopes", scopes}, {"quotas", usage_json(quotas)}, {"used", usage_json(used)}});
}

std::string write_ticket(const std::string& url, std::optional<std::int64_t> expires_at_unix_ms) {
  return text_of({{"url", url}, {"expires_at", time_json(expires_at_unix_ms)}});
}

std::string write_bulk(std::int64_t matched, std::int64_t done,
                       const std::vector<std::pair<std::string, std::string_view>>& refused) {
  Json items = Json::array();
  for (const auto& [id, code] : refused) items.push_back({{"id", id}, {"code", code}});
  return text_of({{"matched", matched}, {"done", done}, {"refused", std::move(items)}});
}

std::string write_problem(const ProblemReply& problem) {
  Json json{{"type", problem.type},
            {"title", problem.title},
            {"status", problem.status},
            {"detail", problem.detail},
            {"request_id", problem.request_id}};
  if (!problem.errors.empty()) json["errors"] = errors_json(problem.errors);
  return text_of(json);
}

std::string write_version(std::string_view version, std::string_view build, std::string_view sandbox, bool dashboard,
                          const std::vector<std::pair<std::string, std::uint64_t>>& limits) {
  Json bounds = Json::object();
  for (const auto& [name, value] : limits) bounds[name] = value;
  return text_of({{"version", version},
                  {"build", build},
                  {"sandbox", sandbox.empty() ? Json(nullptr) : Json(sandbox)},
                  {"dashboard", dashboard},
                  {"limits", std::move(bounds)}});
}

}  // namespace resources
