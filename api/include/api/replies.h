#pragma once
/// Writes what the service answers, as JSON text with the names of api/docs/http.md. Times are RFC 3339 UTC
/// with milliseconds; unknown values are null; invalid UTF-8 is replaced by U+FFFD. Fails only for lack of memory.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/document.h"
#include "server/queue/delivery_store.h"
#include "server/queue/events.h"
#include "server/queue/job.h"
#include "server/queue/job_service.h"
#include "tracer/requirements.h"
#include "tracer/scene.h"
#include "tracer/validate.h"

namespace api {

/// `now_ms` (since 1970 UTC) is what eta_s is reckoned from: the time so far, stretched by the tiles still to do; null
/// until a hundredth of them is done.
std::string write_job(const queue::JobView& view, std::int64_t now_ms);

/// What a webhook tells: {type, timestamp, data: the job}. `event` is "job.succeeded" or the like.
std::string write_event(std::string_view event, const queue::JobView& view, std::int64_t now_ms);

/// {items: [{id, event, url, state, created_at, next_attempt_at, attempts: [{at, duration_ms, status, detail}]}]}
std::string write_deliveries(const std::vector<queue::Delivery>& deliveries);

/// {items, next_cursor}; an empty cursor is written as null.
std::string write_job_list(const std::vector<queue::JobView>& views, const std::string& next_cursor,
                           std::int64_t now_ms);

/// {id, state, progress, at}, one line: the data of an event.
std::string write_event(const queue::JobEvent& event);

/// {id, name, state, progress, created_at, size, jobs{state: count}, max_failed, links}. The state is queued or running
/// while a job has not ended, else failed or cancelled where one is, else succeeded; progress is the share that ended.
std::string write_batch(const queue::BatchState& state);

/// {jobs{state: count}, queued_by_priority{priority: count}, delayed, running, oldest_age_s, eta_s}
std::string write_queue(const queue::QueueState& state);

/// RFC 9457. `errors` is left out where there are none.
struct ProblemReply {
  std::string type, title;
  int status = 500;
  std::string detail, request_id;
  std::vector<tracer::Issue> errors;
};
std::string write_problem(const ProblemReply& problem);

/// {valid: true, errors: [], requirements, estimate{samples, seconds, memory_bytes}}. `samples` are those of all pixels
/// together, where sampling adapts the fewest that there may be; `memory_bytes` is api/estimate.h's. `seconds` are its
/// estimated_work at that pace, a time budget at most; null where either is not known.
std::string write_valid(const tracer::Scene& scene, std::optional<double> seconds_per_work);
/// {valid: false, errors, requirements: null, estimate: null}
std::string write_invalid(const std::vector<tracer::Issue>& errors);

/// {version, build, sandbox, limits{name: value}}; an empty sandbox is written as null.
std::string write_version(std::string_view version, std::string_view build, std::string_view sandbox,
                          const std::vector<std::pair<std::string, std::uint64_t>>& limits);

/// The document with `format` added to its output.formats; otherwise it means the same. Precondition: parse_scene
/// accepts it.
std::string with_format(const std::string& document, tracer::Format format);

}  // namespace api
