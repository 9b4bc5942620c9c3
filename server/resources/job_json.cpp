#include "server/resources/job_json.h"

#include <algorithm>
#include <cmath>

#include "server/resources/json_values.h"

namespace resources {
namespace {

Json eta_json(const queue::JobView& view, std::int64_t now_ms) {
  if (view.job.state != queue::JobState::running || !view.job.started_at || view.progress < 0.01) return nullptr;
  const double so_far_s = static_cast<double>(std::max<std::int64_t>(now_ms - *view.job.started_at, 0)) / 1000;
  return std::round(so_far_s * (1 - view.progress) / view.progress * 1000) / 1000;
}

Json job_problem_json(const std::optional<queue::Problem>& problem) {
  if (!problem) return nullptr;
  return {{"code", problem->code}, {"detail", problem->detail}, {"errors", errors_json(problem->errors)}};
}

/// What is kept with a job was written here; of one kept by a build that wrote it otherwise the other fields are told.
Json kept_json(const std::string& kept) {
  if (kept.empty()) return nullptr;
  Json json = Json::parse(kept, nullptr, false);
  return json.is_discarded() ? Json(nullptr) : json;
}

bool may_be_retried(const queue::Job& job) {
  return queue::ended(job.state) && queue::may_move(job.state, queue::JobState::queued) && !job.expired;
}

/// Null where the job has no artifact of that name, or not yet.
Json link_to(const queue::Job& job, const std::string& name) {
  for (const queue::Artifact& artifact : job.artifacts) {
    if (artifact.name == name) return "/v1/jobs/" + job.id + "/" + name;
  }
  return nullptr;
}

Json first_image(const queue::Job& job) {
  return job.artifacts.empty() ? Json(nullptr) : link_to(job, job.artifacts.front().name);
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
          {"attempt", job.attempt},
          {"max_attempts", job.max_attempts},
          {"priority", job.priority},
          {"cancel_requested", job.cancel_requested},
          {"labels", std::move(labels)},
          {"batch", job.batch.empty() ? Json(nullptr) : Json(job.batch)},
          {"image", {{"width", job.width}, {"height", job.height}}},
          {"accuracy", kept_json(job.accuracy)},
          {"report", kept_json(measured ? std::string() : job.report)},
          {"measurement", kept_json(measured ? job.report : std::string())},
          {"problem", job_problem_json(job.problem)},
          {"artifacts", std::move(artifacts)},
          {"links",
           {{"self", self},
            {"cancel", queue::ended(job.state) ? Json(nullptr) : Json(self + "/cancel")},
            {"retry", may_be_retried(job) ? Json(self + "/retry") : Json(nullptr)},
            {"events", self + "/events"},
            {"preview", self + "/preview"},
            {"image", measured ? link_to(job, "measure.png") : first_image(job)},
            {"measurement", measured ? link_to(job, "measure.json") : Json(nullptr)}}}};
}

}  // namespace

std::string write_job(const queue::JobView& view, std::int64_t now_ms) { return text_of(job_json(view, now_ms)); }

std::string write_event(std::string_view event, const queue::JobView& view, std::int64_t now_ms) {
  return text_of({{"type", event}, {"timestamp", time_json(now_ms)}, {"data", job_json(view, now_ms)}});
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

std::string write_job_list(const std::vector<queue::JobView>& views, const std::string& next_cursor,
                           std::int64_t now_ms) {
  Json items = Json::array();
  for (const queue::JobView& view : views) items.push_back(job_json(view, now_ms));
  Json cursor = next_cursor.empty() ? Json(nullptr) : Json(next_cursor);
  return text_of({{"items", std::move(items)}, {"next_cursor", std::move(cursor)}});
}

std::string write_event(const queue::JobEvent& event) {
  return text_of(
      {{"id", event.job_id}, {"state", event.state}, {"progress", event.progress}, {"at", time_json(event.at)}});
}

}  // namespace resources
