/// One action on many jobs.

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "api/json.h"
#include "api/reader/fields.h"
#include "server/http/handlers/handlers.h"

namespace http::handlers {
namespace {

using api::Cursor, api::Reading;

constexpr std::size_t bulk_jobs_max = 10'000;

enum class Action { cancel, retry, remove, priority };
constexpr auto words_of(Action first) { return tracer::in_order(first, {"cancel", "retry", "remove", "priority"}); }

/// An action on jobs that are named by id or by a filter.
struct BulkRequest {
  Action action = Action::cancel;
  std::vector<std::string> ids;  ///< at most bulk_jobs_max, without duplicates; empty with a filter
  Pairs filter;                  ///< parameters of GET /v1/jobs, not checked; not empty where `ids` is
  int priority = 0;              ///< 0..100, of Action::priority
  bool dry_run = false;
};

void read_ids(Reading& reading, const Cursor& at, std::vector<std::string>& ids) {
  std::set<std::string_view> known;
  if (!within_limit(reading, at, "bulk_jobs", bulk_jobs_max)) return;
  const bool is_list = for_each_element(reading, at, [&](const Cursor& element) {
    if (expect_string(reading, element, "the id of a job") && known.insert(element.node->string()).second)
      ids.emplace_back(element.node->string());
  });
  if (is_list && at.node->size == 0) add_issue(reading, at, "wrong_length", "must name at least one job");
}

/// Each member is a value, or a list of values.
void read_filter(Reading& reading, const Cursor& at, Pairs& filter) {
  const bool is_object = for_each_member(reading, at, [&](const Cursor& member) {
    const auto add = [&](const Cursor& value) {
      if (expect_string(reading, value)) filter.emplace_back(member.key, value.node->string());
    };
    if (member.node->kind == api::json::Kind::array) {
      for_each_element(reading, member, add);
    } else {
      add(member);
    }
  });
  if (is_object && filter.empty())
    add_issue(reading, at, "wrong_length", "must have a condition: no action is on all jobs");
}

void read_bulk(Reading& reading, BulkRequest& request) {
  api::Fields fields(reading, reading.root, "a bulk request");
  fields.required("action", request.action);
  if (request.action == Action::priority) fields.required("value", api::Integer<int>{request.priority, 0, 100});
  const auto ids = fields.take("ids"), filter = fields.take("filter");
  if (ids) read_ids(reading, *ids, request.ids);
  if (filter) read_filter(reading, *filter, request.filter);
  if (!ids && !filter) fields.report_missing_one_of(std::array<std::string_view, 2>{"ids", "filter"});
  if (ids && filter) add_issue(reading, *filter, "conflict", "must not be given together with ids");
  fields.optional("dry_run", request.dry_run);
  fields.finish();
}

Problem invalid(const std::string& detail) { return {failures::invalid_request, detail}; }

/// The ids of the jobs that the filter selects. Problem: the filter is invalid, or selects too many.
tracer::Result<std::vector<std::string>, Problem> selected_jobs(const Pairs& filter, const ApiContext& context) {
  constexpr std::array known{"state", "label", "batch", "kind", "owner", "created_after", "created_before", "q"};
  for (const auto& [name, value] : filter) {
    if (std::ranges::find(known, name) == known.end()) return invalid("the filter has no " + name);
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
  } while (!cursor.empty() && ids.size() <= bulk_jobs_max);
  if (ids.size() <= bulk_jobs_max) return ids;
  return invalid("the filter selects more than " + std::to_string(bulk_jobs_max) + " jobs");
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
bool apply(const BulkRequest& bulk, const std::string& id, queue::JobLifecycle& lifecycle) {
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
  const auto bulk = take_request(request, "a bulk request", read_bulk, context.limits);
  if (!bulk) return bulk.error();
  if (bulk->action == Action::retry) {
    if (auto problem = refuse_if_draining(context)) return *problem;
  }
  tracer::Result<std::vector<std::string>, Problem> ids = bulk->ids;
  if (!bulk->filter.empty()) ids = selected_jobs(bulk->filter, context);
  if (!ids) return ids.error();
  std::int64_t done = 0;
  api::Json refused = api::Json::array();
  for (const std::string& id : *ids) {
    const auto find = [&] { return is_id(id) ? context.queue.queries.find(id) : std::nullopt; };
    const Failure* failure = refusal_of(bulk->action, find());
    const bool changed = failure == nullptr && !bulk->dry_run && apply(*bulk, id, context.queue.lifecycle);
    if (changed) ++done;
    if (failure == nullptr && !changed && !bulk->dry_run) {
      failure = refusal_of(bulk->action, find());
      if (failure == nullptr) failure = &failures::precondition_failed;  // it changes all the time
    }
    if (failure != nullptr) refused.push_back({{"id", id}, {"code", failure->name}});
  }
  if (done > 0) context.queue.lifecycle.sync();
  return json_reply(200, api::json_line({{"matched", ids->size()}, {"done", done}, {"refused", std::move(refused)}}));
}

}  // namespace

Endpoints bulk_endpoints() { return {{"POST", "/v1/jobs/bulk", change_jobs, {.one_at_a_time = true}}}; }

}  // namespace http::handlers
