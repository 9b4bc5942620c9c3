#include "server/resources/queue_json.h"

#include "server/resources/json_values.h"

namespace resources {

std::string write_batch(const queue::BatchState& state) {
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
  const queue::JobState verdict = ended < all            ? (count(queued) == all ? queued : running)
                                  : count(failed) > 0    ? failed
                                  : count(cancelled) > 0 ? cancelled
                                                         : succeeded;
  const queue::Batch& batch = state.batch;
  const std::string self = "/v1/batches/" + batch.id;
  const bool may_retry = count(failed) + count(cancelled) > 0;
  return text_of({{"id", batch.id},
                  {"name", batch.name},
                  {"state", queue::name_of(verdict)},
                  {"progress", all == 0 ? 1.0 : static_cast<double>(ended) / static_cast<double>(all)},
                  {"created_at", time_json(batch.created_at)},
                  {"size", batch.size},
                  {"jobs", std::move(by_state)},
                  {"max_failed", batch.max_failed ? Json(*batch.max_failed) : Json(nullptr)},
                  {"links",
                   {{"self", self},
                    {"jobs", "/v1/jobs?batch=" + batch.id},
                    {"cancel", ended < all ? Json(self + "/cancel") : Json(nullptr)},
                    {"retry", may_retry ? Json(self + "/retry") : Json(nullptr)},
                    {"artifacts", count(succeeded) > 0 ? Json(self + "/artifacts.tar") : Json(nullptr)}}}});
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
                  {"eta_s", state.eta_s ? Json(*state.eta_s) : Json(nullptr)}});
}

}  // namespace resources
