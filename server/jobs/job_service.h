#pragma once
/// What the HTTP room asks of the queue. One object, thread-safe; it knows neither HTTP nor SQL nor the worker process.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "api/document.h"
#include "server/jobs/artifact_store.h"
#include "server/jobs/job.h"
#include "server/jobs/job_store.h"
#include "tracer/result.h"

namespace jobs {

/// A job and what only the running daemon knows of it.
struct JobView {
  Job job;
  double progress = 0;  ///< tiles done / tiles; 1 when succeeded
};

struct QueueFull {
  std::int64_t queued = 0, limit = 0;
};

class JobService {
 public:
  virtual ~JobService() = default;

  /// Durable when it returns. `document` is kept verbatim; `parsed` is what api::parse_scene made of it.
  virtual tracer::Result<JobView, QueueFull> submit(const std::string& document, const api::Document& parsed) = 0;

  virtual std::optional<JobView> find(const std::string& id) = 0;
  virtual JobPage list(const JobFilter& filter, const std::string& cursor, int limit) = 0;
  virtual double progress(const std::string& id) = 0;

  /// Queued: cancelled at once. Running: the worker is told; the job moves within 100 ms.
  virtual CancelOutcome cancel(const std::string& id) = 0;
  virtual RemoveOutcome remove(const std::string& id) = 0;

  virtual std::unique_ptr<ArtifactReader> open(const Artifact& artifact) = 0;

  /// Calls `done` once, from any thread, when the job has ended (at once, from this thread, if it has or does not
  /// exist). `done` must be quick and must not throw. Returns a token for `forget`.
  virtual std::uint64_t when_ended(const std::string& id, std::function<void()> done) = 0;
  virtual void forget(std::uint64_t token) = 0;

  /// For readiness: empty when all is well, else why not ("store: disk full", "worker: restarting", "draining").
  /// Costs a small durable write: not to be asked more than about once a second.
  virtual std::string not_ready() = 0;
};

}  // namespace jobs
