#pragma once
/// Reads of jobs, batches and the queue.

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "server/queue/queue_context.h"

namespace queue {

struct QueueState {
  QueueDepth depth;
  std::map<JobState, std::int64_t> jobs;  ///< all of them, by state
  std::optional<double> oldest_age_s;     ///< age of the oldest job that may run now
  /// Time until all queued jobs have ended, estimated from the latest ends; empty until two jobs have ended.
  std::optional<double> eta_s;
};

/// Thread-safe. Every call may throw StoreFailure.
class JobQueries {
 public:
  explicit JobQueries(QueueContext& context) : context_(context) {}

  std::optional<JobView> find(const std::string& id);
  JobPage list(const JobFilter& filter, const std::string& cursor, int limit);
  double progress(const std::string& id);
  std::optional<BatchState> find_batch(const std::string& id);
  QueueState state();
  std::unique_ptr<ArtifactReader> open(const Artifact& artifact);  ///< as ArtifactPins::open

  /// For readiness: empty, or the reason ("store: disk full", "worker: restarting", "draining"). Costs a small durable
  /// write, so about once a second is often enough.
  std::string not_ready();

 private:
  QueueContext& context_;
};

}  // namespace queue
