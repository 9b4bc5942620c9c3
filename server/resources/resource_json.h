#pragma once
/// JSON of jobs, their events, webhook deliveries, batches, the queue, problems and the version (schemas of
/// api/openapi.yaml), one line each. Times are RFC 3339 in UTC with milliseconds; unknown values are null;
/// invalid UTF-8 is replaced by U+FFFD. Throws std::bad_alloc only.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/queue/delivery_store.h"
#include "server/queue/events.h"
#include "server/queue/job.h"
#include "server/queue/queue.h"
#include "server/telemetry/service_metrics.h"
#include "tracer/validate.h"

namespace resources {

std::string time_text(std::int64_t unix_ms);

/// `now_ms` (since 1970 UTC) is the base of eta_s of a running job: the elapsed time, extrapolated by the progress;
/// null below 1 %.
std::string write_job(const queue::JobView& view, std::int64_t now_ms);

/// {items: [job], next_cursor}; an empty cursor becomes null.
std::string write_job_list(const std::vector<queue::JobView>& views, const std::string& next_cursor,
                           std::int64_t now_ms);

/// {id, state, progress, at, kind, name, batch, owner}: the data of a server-sent event.
std::string write_event(const queue::JobEvent& event);

/// Body of a webhook: {type, timestamp, data: job}. `event` is "job.succeeded", "job.failed" or "job.cancelled".
std::string write_event(std::string_view event, const queue::JobView& view, std::int64_t now_ms);

/// Body of a test call: {type, timestamp, data: {}}.
std::string write_event(std::string_view event, std::int64_t now_ms);

/// {items: [{id, event, url, state, created_at, next_attempt_at, attempts: [{at, duration_ms, status, detail}]}]}
std::string write_deliveries(const std::vector<queue::Delivery>& deliveries);

/// {items: [{at, state, attempt, code, detail, worker}]}; an empty code or worker becomes null.
std::string write_history(const std::vector<queue::JobMove>& moves);

/// {id, name, state, progress, created_at, size, jobs{state: count}, owner, sweep, max_failed, links}. The state is
/// queued or running until every job has ended; then failed or cancelled if a job is, else succeeded. Progress is the
/// share of ended jobs.
std::string write_batch(const queue::BatchState& state);

/// {items: [batch], next_cursor}
std::string write_batch_list(const queue::BatchPage& page);

/// {jobs{state: count}, queued_by_priority{priority: count}, delayed, running, oldest_age_s, eta_s}
std::string write_queue(const queue::QueueState& state);

/// The state of the service (schema Status).
struct ServiceStatus {
  std::string not_ready;  ///< empty: ready
  bool draining = false;
  std::string sandbox;
  telemetry::GaugeValues gauges;
  queue::QueueState queue;
  std::size_t streams_max = 0;
  std::vector<std::pair<std::string, std::uint64_t>> limits;
  std::optional<telemetry::ServiceHistory::Hour> hour;
};
std::string write_status(const ServiceStatus& status);

/// {items[{id, name, role, version, slots, running, started_at, seen_at}]}
std::string write_nodes(const std::vector<queue::Node>& nodes);

/// {name, scopes, quotas, used}; an empty name becomes null.
std::string write_me(const std::string& name, const std::vector<std::string_view>& scopes,
                     const queue::OwnerUsage& quotas, const queue::OwnerUsage& used);

/// {url, expires_at} of a ticket; a time of none is null.
std::string write_ticket(const std::string& url, std::optional<std::int64_t> expires_at_unix_ms);

/// {matched, done, refused[{id, code}]} of a request for many jobs.
std::string write_bulk(std::int64_t matched, std::int64_t done,
                       const std::vector<std::pair<std::string, std::string_view>>& refused);

/// RFC 9457. An empty `errors` is omitted.
struct ProblemReply {
  std::string type, title;
  int status = 500;
  std::string detail, request_id;
  std::vector<tracer::Issue> errors;
};
std::string write_problem(const ProblemReply& problem);

/// {version, build, sandbox, dashboard, limits{name: value}}; an empty sandbox becomes null.
std::string write_version(std::string_view version, std::string_view build, std::string_view sandbox, bool dashboard,
                          const std::vector<std::pair<std::string, std::uint64_t>>& limits);

}  // namespace resources
