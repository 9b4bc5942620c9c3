#pragma once
/// A job as the queue knows it: plain values with the names of HTTP.md. Times are milliseconds since 1970 UTC.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tracer/validate.h"

namespace jobs {

enum class JobState { queued, running, succeeded, failed, cancelled };

/// The one table of moves. running -> queued is a retry or a recovered lease; finished states never change
/// (a user's retry is POST .../retry, which comes with its own move when it is built).
constexpr bool may_move(JobState from, JobState to) {
  using enum JobState;
  if (from == queued) return to == running || to == cancelled;
  if (from == running) return to == queued || to == succeeded || to == failed || to == cancelled;
  return false;
}
constexpr bool ended(JobState state) { return state != JobState::queued && state != JobState::running; }
const char* name_of(JobState state);
std::optional<JobState> job_state(const std::string& name);

struct Artifact {
  std::string name;        ///< "image.png"
  std::string media_type;  ///< "image/png"
  std::string sha256;      ///< 64 hex digits: the key in the ArtifactStore and the ETag
  std::uint64_t bytes = 0;
};

/// Why a job failed, in words for its owner.
struct Problem {
  std::string code;    ///< stable: "bad_scene", "worker_crashed", "out_of_memory", "internal", ...
  std::string detail;  ///< one sentence
  std::vector<tracer::Issue> errors;
};

struct Job {
  std::string id;  ///< UUIDv7, so ids sort by creation
  std::string name;
  JobState state = JobState::queued;
  std::int64_t created_at = 0;
  std::optional<std::int64_t> started_at;  ///< of the latest attempt
  std::optional<std::int64_t> ended_at;
  int attempt = 0;  ///< attempts begun, the running one included; drain and restart of the daemon give theirs back
  int max_attempts = 3;
  int priority = 50;
  bool cancel_requested = false;  ///< running, and will move to cancelled
  bool suspect = false;           ///< was in flight with others when a worker died: runs alone until it ends
  std::map<std::string, std::string> labels;
  std::uint32_t width = 0, height = 0;
  std::vector<std::string> assets;  ///< sha256 of the uploads that its document names; they are kept while it is there
  std::string report;               ///< JSON text written by api::, opaque here; empty until the job succeeded
  std::optional<Problem> problem;
  std::vector<Artifact> artifacts;
};

}  // namespace jobs
