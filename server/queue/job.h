#pragma once
/// A job as the queue knows it: plain values with the names of HTTP.md. Times are milliseconds since 1970 UTC.

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "api/document.h"
#include "tracer/validate.h"

namespace queue {

enum class JobState { queued, running, succeeded, failed, cancelled };
inline constexpr std::array all_job_states{JobState::queued, JobState::running, JobState::succeeded, JobState::failed,
                                           JobState::cancelled};

/// The one table of moves. queued -> failed is a deadline that passed; running -> queued another attempt or a job
/// recovered from a dead daemon; failed and cancelled -> queued a retry that its owner asked for. What succeeded stays.
constexpr bool may_move(JobState from, JobState to) {
  using enum JobState;
  if (from == queued) return to == running || to == failed || to == cancelled;
  if (from == running) return to == queued || to == succeeded || to == failed || to == cancelled;
  return from != succeeded && to == queued;
}
constexpr bool ended(JobState state) { return state != JobState::queued && state != JobState::running; }
const char* name_of(JobState state);
std::optional<JobState> job_state(const std::string& name);

/// What its worker is to do with a job's document.
enum class JobKind {
  render,   ///< a scene document: its images
  measure,  ///< api::MeasureRequest: the scene rendered along its parameters, as figures and a chart
};
inline constexpr std::array all_job_kinds{JobKind::render, JobKind::measure};
const char* name_of(JobKind kind);
std::optional<JobKind> job_kind(const std::string& name);

struct Artifact {
  std::string name;        ///< "image.png"
  std::string media_type;  ///< "image/png"
  std::string sha256;      ///< 64 hex digits: the key in the ArtifactStore and the ETag
  std::uint64_t bytes = 0;
};

/// Why a job failed, in words for its owner.
struct Problem {
  /// Stable: "bad_scene", "bad_asset", "worker_crashed", "out_of_memory", "timed_out", "deadline_exceeded",
  /// "storage_failure", "internal".
  std::string code;
  std::string detail;  ///< one sentence
  std::vector<tracer::Issue> errors;
};

Problem deadline_exceeded();  ///< of a job whose deadline has passed

struct Job {
  std::string id;  ///< UUIDv7, so ids sort by creation
  JobKind kind = JobKind::render;
  std::string owner;  ///< name of the API key it came with; empty without keys
  std::string name;
  std::string batch;    ///< id of the batch it belongs to; empty: none
  int batch_index = 0;  ///< its place in there, from 0
  JobState state = JobState::queued;
  std::int64_t created_at = 0;
  std::optional<std::int64_t> started_at;  ///< of the latest attempt
  std::optional<std::int64_t> ended_at;
  int attempt = 0;  ///< attempts begun, the running one included; drain and restart of the daemon give theirs back
  int max_attempts = 3;
  int priority = 50;
  std::optional<std::int64_t> run_after;  ///< as asked for
  std::optional<std::int64_t>
      not_before;                        ///< queued, and not to be claimed yet: run_after, or a pause between attempts
  std::optional<std::int64_t> deadline;  ///< it fails when it has not ended by then
  std::optional<std::int64_t> expires_in_s;  ///< from its end to expires_at
  std::optional<std::int64_t> expires_at;    ///< from then on its document and images may go, once it has ended
  bool expired = false;                      ///< they are gone
  std::optional<api::Webhook> webhook;
  bool cancel_requested = false;  ///< running, and will move to cancelled
  bool suspect = false;           ///< was in flight with others when a worker died: runs alone until it ends
  std::map<std::string, std::string> labels;
  std::uint32_t width = 0, height = 0;
  std::string accuracy;             ///< as its document asks for it: JSON text written by api::, opaque here
  bool large = false;               ///< may take long (api::is_large): it leaves a place to those that do not
  std::vector<std::string> assets;  ///< sha256 of the uploads that its document names; they are kept while it is there
  std::string report;  ///< what came of it: JSON text written by api::, opaque here; empty until the job succeeded
  std::optional<Problem> problem;
  std::vector<Artifact> artifacts;
  std::string content_key;    ///< what the result cache knows its images by; empty: not at all
  std::int64_t revision = 1;  ///< grows with every change of the row
};

/// Moves it to an end. Precondition: may_move.
void end(Job& job, JobState state, std::int64_t now);

/// What the queue is ordered by, the least first: a point of priority is worth a minute of waiting, so that low
/// priorities wait, but not for ever. Now is the same for all, so it is left out and the order of two jobs never
/// changes: an index holds it.
constexpr std::int64_t rank_of(std::int64_t created_at, std::optional<std::int64_t> run_after, int priority) {
  const std::int64_t waits_since = run_after && *run_after > created_at ? *run_after : created_at;
  return waits_since - std::int64_t{60'000} * priority;
}

}  // namespace queue
