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

/// Body of a webhook: {type, timestamp, data: job}. `event` is "job.succeeded", "job.failed" or "job.cancelled".
std::string write_event(std::string_view event, const queue::JobView& view, std::int64_t now_ms);

/// Body of a test call: {type, timestamp, data: {}}.
std::string write_event(std::string_view event, std::int64_t now_ms);

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

/// RFC 9457. An empty `errors` is omitted.
struct ProblemReply {
  std::string type, title;
  int status = 500;
  std::string detail, request_id;
  std::vector<tracer::Issue> errors;
};

/// A resource of a type with json_of() in resource_json.cpp: an event, a list of deliveries, moves or nodes, a batch, a
/// page of batches, the queue, the status, a problem.
template <class Resource>
std::string write(const Resource& resource);

/// {version, build, sandbox, dashboard, limits{name: value}}; an empty sandbox becomes null.
std::string write_version(std::string_view version, std::string_view build, std::string_view sandbox, bool dashboard,
                          const std::vector<std::pair<std::string, std::uint64_t>>& limits);

}  // namespace resources
