/// One action on many jobs.

#include <algorithm>
#include <array>
#include <utility>

#include "api/requests.h"
#include "server/http/handlers/handlers.h"
#include "server/resources/resource_json.h"

namespace http::handlers {
namespace {

using Action = api::BulkRequest::Action;

Problem invalid(const std::string& detail) { return {failures::invalid_request, detail}; }

/// The ids of the jobs that the filter selects. Problem: the filter is invalid, or selects too many.
tracer::Result<std::vector<std::string>, Problem> selected_jobs(const Pairs& filter, const ApiContext& context) {
  constexpr std::array known{"state", "label", "batch", "kind", "owner", "created_after", "created_before", "q"};
  for (const auto& [name, value] : filter) {
    if (std::find(known.begin(), known.end(), name) == known.end()) return invalid("the filter has no " + name);
    if (value.empty() && name != "owner") return invalid(name + " of the filter is empty");
  }
  if (const std::string repeated(repeated_name(filter)); !repeated.empty())
    return invalid("filter: " + repeated + " is given twice");
  const auto query = read_list_query(filter);
  if (!query) return invalid("filter: " + query.error().detail);
  std::vector<std::string> ids;
  std::string cursor;
  do {
    const queue::JobPage page = context.queue.queries.list(query->filter, cursor, 1000);
    for (const queue::Job& job : page.items) ids.push_back(job.id);
    cursor = page.next_cursor;
  } while (!cursor.empty() && ids.size() <= api::bulk_jobs_max);
  if (ids.size() <= api::bulk_jobs_max) return ids;
  return invalid("the filter selects more than " + std::to_string(api::bulk_jobs_max) + " jobs");
}

/// The reason why the action is not possible; null if it is.
const Failure* refusal_of(Action action, const std::optional<queue::JobView>& view) {
  if (!view) return &failures::job_not_found;
  const queue::Job& job = view->job;
  const bool ended = queue::ended(job.state);
  switch (action) {
    case Action::cancel:
    case Action::priority:
      return ended ? &failures::job_ended : nullptr;
    case Action::remove:
      return job.state == queue::JobState::running ? &failures::job_running : nullptr;
    case Action::retry:
      if (!ended || job.state == queue::JobState::succeeded) return &failures::job_not_failed;
      return job.expired ? &failures::job_expired : nullptr;
  }
  return nullptr;
}

/// True if the job was changed; otherwise its state has changed since it was read.
bool apply(const api::BulkRequest& bulk, const std::string& id, queue::JobLifecycle& lifecycle) {
  constexpr bool durable = false;
  switch (bulk.action) {
    case Action::cancel: {
      const queue::CancelOutcome outcome = lifecycle.cancel(id, durable);
      return outcome == queue::CancelOutcome::cancelled || outcome == queue::CancelOutcome::cancelling;
    }
    case Action::retry:
      return lifecycle.retry(id, durable) == queue::RetryOutcome::queued;
    case Action::remove:
      return lifecycle.remove(id, durable) == queue::RemoveOutcome::removed;
    case Action::priority:
      break;
  }
  queue::JobChange change;
  change.priority = bulk.priority;
  return lifecycle.change(id, change, {}, durable) == queue::ChangeOutcome::changed;
}

Answer change_jobs(Request& request, const ApiContext& context) {
  const auto bulk = take_request(request, "a bulk request", api::parse_bulk, context.limits);
  if (!bulk) return bulk.error();
  if (bulk->action == Action::retry) {
    if (auto problem = refuse_if_draining(context)) return *problem;
  }
  tracer::Result<std::vector<std::string>, Problem> ids = bulk->ids;
  if (!bulk->filter.empty()) ids = selected_jobs(bulk->filter, context);
  if (!ids) return ids.error();
  std::int64_t done = 0;
  std::vector<std::pair<std::string, std::string_view>> refused;
  for (const std::string& id : *ids) {
    const auto find = [&] { return is_id(id) ? context.queue.queries.find(id) : std::nullopt; };
    const Failure* failure = refusal_of(bulk->action, find());
    const bool changed = failure == nullptr && !bulk->dry_run && apply(*bulk, id, context.queue.lifecycle);
    if (changed) ++done;
    if (failure == nullptr && !changed && !bulk->dry_run) {
      failure = refusal_of(bulk->action, find());
      if (failure == nullptr) failure = &failures::precondition_failed;  // it changes all the time
    }
    if (failure != nullptr) refused.emplace_back(id, failure->name);
  }
  if (done > 0) context.queue.lifecycle.sync();
  return json_reply(200, resources::write_bulk(static_cast<std::int64_t>(ids->size()), done, refused));
}

}  // namespace

Endpoints bulk_endpoints() { return {{"POST", "/v1/jobs/bulk", change_jobs, {}, true}}; }

}  // namespace http::handlers
