#pragma once
/// JSON of batches and of the queue's state (the schemas Batch and Queue of api/openapi.yaml), one line each.

#include <string>

#include "server/queue/job_queries.h"

namespace resources {

/// {id, name, state, progress, created_at, size, jobs{state: count}, max_failed, links}. The state is queued or running
/// until every job has ended; then failed or cancelled if a job is, else succeeded. Progress is the share of ended
/// jobs.
std::string write_batch(const queue::BatchState& state);

/// {jobs{state: count}, queued_by_priority{priority: count}, delayed, running, oldest_age_s, eta_s}
std::string write_queue(const queue::QueueState& state);

}  // namespace resources
