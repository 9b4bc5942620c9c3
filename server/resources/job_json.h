#pragma once
/// JSON of jobs, their events and webhook deliveries (the schemas Job, Event and Delivery of api/openapi.yaml), one
/// line each. Times are RFC 3339 in UTC with milliseconds; unknown values are null; invalid UTF-8 is replaced by
/// U+FFFD. Throws std::bad_alloc only.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "server/queue/delivery_store.h"
#include "server/queue/events.h"
#include "server/queue/submission.h"

namespace resources {

/// `now_ms` (since 1970 UTC) is the base of eta_s: the elapsed time, extrapolated by the progress; null below 1 %.
std::string write_job(const queue::JobView& view, std::int64_t now_ms);

/// {items: [job], next_cursor}; an empty cursor becomes null.
std::string write_job_list(const std::vector<queue::JobView>& views, const std::string& next_cursor,
                           std::int64_t now_ms);

/// {id, state, progress, at}: the data of a server-sent event.
std::string write_event(const queue::JobEvent& event);

/// Body of a webhook: {type, timestamp, data: job}. `event` is "job.succeeded", "job.failed" or "job.cancelled".
std::string write_event(std::string_view event, const queue::JobView& view, std::int64_t now_ms);

/// {items: [{id, event, url, state, created_at, next_attempt_at, attempts: [{at, duration_ms, status, detail}]}]}
std::string write_deliveries(const std::vector<queue::Delivery>& deliveries);

}  // namespace resources
