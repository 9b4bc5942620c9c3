#pragma once
/// Jobs, batches and submissions: plain values with the names of api/docs/http.md. Times are milliseconds since 1970
/// UTC.

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
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

/// The transition table. queued -> failed: the deadline has passed. running -> queued: another attempt, or a job
/// recovered from a dead daemon. failed, cancelled -> queued: a retry by the owner. succeeded -> queued: the same,
/// because an image is damaged.
constexpr bool may_move(JobState from, JobState to) {
  using enum JobState;
  if (from == queued) return to == running || to == failed || to == cancelled;
  if (from == running) return to == queued || to == succeeded || to == failed || to == cancelled;
  return to == queued;
}
constexpr bool ended(JobState state) { return state != JobState::queued && state != JobState::running; }
const char* name_of(JobState state);
std::optional<JobState> job_state(const std::string& name);

/// The kind of work that a job's document describes.
enum class JobKind {
  render,   ///< a scene document: its images
  measure,  ///< api::MeasureRequest: the scene rendered along its parameters, as metrics and a chart
};
inline constexpr std::array all_job_kinds{JobKind::render, JobKind::measure};
const char* name_of(JobKind kind);
std::optional<JobKind> job_kind(const std::string& name);

struct Artifact {
  std::string name;        ///< "image.png"
  std::string media_type;  ///< "image/png"
  std::string sha256;      ///< 64 hex digits: the key in the ArtifactStore and the ETag
  std::uint64_t bytes = 0;
  bool operator==(const Artifact&) const = default;
};

/// The reason of a failure, for the owner of the job.
struct Problem {
  /// Stable: "bad_scene", "bad_asset", "worker_crashed", "out_of_memory", "timed_out", "deadline_exceeded",
  /// "storage_failure", "internal".
  std::string code;
  std::string detail;  ///< one sentence
  std::vector<tracer::Issue> errors;
  bool operator==(const Problem&) const = default;
};

Problem deadline_exceeded();

/// A job: what was requested (run_after is the one submitted; its `cache` is not kept), and what became of it.
struct Job : api::JobRequest {
  std::string id;  ///< UUIDv7, so ids sort by creation
  JobKind kind = JobKind::render;
  std::string owner;      ///< name of the API key; empty without keys
  int weight = 1;         ///< turns of the owner for each turn of an owner with weight 1, see JobTransitions::claim
  std::string batch;      ///< id of the batch it belongs to; empty: none
  int batch_index = 0;    ///< position in the batch, from 0
  std::string variation;  ///< api::Frame::variation; empty: not in a batch, or too long
  JobState state = JobState::queued;
  std::int64_t created_at = 0;
  std::optional<std::int64_t> started_at;  ///< start of the latest attempt
  std::optional<std::int64_t> ended_at;
  int attempt = 0;  ///< attempts begun, except those ended by drain or restart of the daemon
  /// Queued, and not claimed before: run_after, or a pause between attempts.
  std::optional<std::int64_t> not_before;
  std::optional<std::int64_t> expires_at;  ///< then the document and images of an ended job are deleted
  bool expired = false;                    ///< they were deleted
  bool cancel_requested = false;           ///< running, and will become cancelled
  bool suspect = false;                    ///< was in flight with others when a worker died: runs alone until it ends
  std::uint32_t width = 0, height = 0;
  std::string formats = "png";  ///< extensions of the files of a render, separated by spaces
  std::string accuracy;         ///< as requested by the document: JSON text written by api::, opaque here
  bool large = false;           ///< may take long (api::is_large), or has taken long
  std::int64_t work = 0;        ///< api::estimated_work, at most work_max; 0: unknown
  /// The sha256 of the uploads that the document names; kept as long as the job. Those of a batch are in CommonScene.
  std::vector<std::string> assets;
  std::string report;  ///< JSON text written by api::, opaque here; empty until the job succeeded
  std::optional<Problem> problem;
  std::vector<Artifact> artifacts;
  bool artifacts_synced = true;  ///< false: power loss may have deleted or truncated them
  /// Identifies the images: sha256 of the canonical document, the files and the build. Empty: not in the result cache.
  std::string content_key;
  bool use_cache = false;     ///< it may end with the images of an equal job
  std::int64_t revision = 1;  ///< grows with every change of the row
  bool operator==(const Job&) const = default;
};

/// A move of a job to another state.
struct JobMove {
  std::int64_t at = 0;
  JobState state = JobState::queued;
  int attempt = 0;
  std::string code, detail;  ///< the reason, as Problem's; empty where the move has none
  std::string worker;        ///< id of the run of the daemon that began the attempt; of moves to running
};
inline constexpr int moves_max = 1000;

/// The fields of a job that its events have.
struct JobSummary {
  std::string id;
  JobKind kind = JobKind::render;
  std::string name = {}, batch = {}, owner = {};  ///< as Job's
  bool keep = true;
  JobState state = JobState::queued;  ///< at the time of the call or reading
};
JobSummary summary_of(const Job& job);

/// An estimate as Job::work. The limit is days on any machine; the sum over all jobs fits into 63 bits.
inline constexpr std::int64_t work_max = 500'000'000'000;
inline std::int64_t work_of(double estimate) {
  return static_cast<std::int64_t>(std::min(estimate, static_cast<double>(work_max)));
}

/// Precondition: may_move.
void end(Job& job, JobState state, std::int64_t now);

/// Order of the queue, least first: a point of priority is worth a minute of waiting, so that low priorities wait, but
/// not forever. The current time is the same for all jobs and left out, so the order of two jobs never changes and an
/// index can hold it.
constexpr std::int64_t rank_of(std::int64_t created_at, std::optional<std::int64_t> run_after, int priority) {
  const std::int64_t waiting_since = run_after && *run_after > created_at ? *run_after : created_at;
  return waiting_since - std::int64_t{60'000} * priority;
}

// ---- submissions

/// A job with the facts that only the running daemon has.
struct JobView {
  Job job;
  double progress = 0;  ///< tiles done / tiles; 1 when succeeded
  /// 1 for the next to run; empty where it is not queued, has a not_before, or has more than 1000 before it.
  std::optional<std::int64_t> queue_position = std::nullopt;
  /// Estimated seconds until a job with a queue_position has ended; empty until a job has succeeded.
  std::optional<double> waiting_eta_s = std::nullopt;
  std::string measurement = {};  ///< results so far of a running measurement, as Job::report
};

/// The first reply to a request, repeated to later ones. Opaque to the queue.
struct FirstReply {
  int status = 202;
  std::string location;
  std::string body;
  bool operator==(const FirstReply&) const = default;
};

/// An Idempotency-Key: of one owner and one route.
struct ReplyKey {
  std::string owner, route, key;
  auto operator<=>(const ReplyKey&) const = default;  // NOLINT(modernize-use-nullptr): of what the compiler writes
};

/// A request that is executed once, however often it is sent.
struct Idempotency {
  std::string route;           ///< "POST /v1/jobs"
  std::string key;             ///< as the client chose it
  std::string request_sha256;  ///< distinguishes other requests under the same key
};

struct Submission {
  std::string document = {};  ///< kept verbatim; in a batch its patch (api::apply_patch)
  Job job = {};               ///< the request, and what the document determines; the queue sets the rest
  std::optional<Idempotency> idempotency = std::nullopt;
  /// False: the client waits for the images and has no id yet. The job then survives the death of the daemon, but
  /// power loss only from JobSubmission::make_durable, or the next durable write of any job, on.
  bool durable = true;
  bool with_position = true;  ///< Submitted::view has the place in the queue, which is two reads of the store
  /// Called before the job is stored when there is `idempotency`: both are stored together.
  std::function<FirstReply(const JobView& view, bool from_cache)> write_reply = nullptr;
};

/// Jobs that are submitted together and stored together or not at all.
struct Batch {
  std::string id;  ///< UUIDv7
  std::string owner;
  std::string name;
  std::string sweep;  ///< api::BatchRequest::sweep, opaque here
  std::int64_t created_at = 0;
  std::optional<int> max_failed;  ///< with more failed jobs than this the rest is cancelled; unset: never
  int size = 0;                   ///< number of jobs at first
};

/// The document that the jobs of a batch have in common. It is kept as long as one of their documents.
struct CommonScene {
  std::string document;
  std::vector<std::string> assets;  ///< sha256 of the uploads that the jobs name
};

/// A batch and the states of its jobs that were not removed.
struct BatchState {
  Batch batch;
  std::map<JobState, std::int64_t> jobs;

  [[nodiscard]] std::int64_t count(JobState which) const {
    const auto found = jobs.find(which);
    return found == jobs.end() ? 0 : found->second;
  }
};

struct BatchSubmission {
  std::vector<Submission> jobs;  ///< at least one; without assets and idempotency of their own
  CommonScene scene;
  Batch batch;  ///< the queue sets its id, time and size
  std::optional<Idempotency> idempotency;
  std::function<FirstReply(const BatchState& state)> write_reply;  ///< as Submission's
};

struct BatchSubmitted {
  BatchState state;  ///< empty in a replay
  std::optional<FirstReply> replayed;
};

struct Submitted {
  JobView view;             ///< empty in a replay
  bool from_cache = false;  ///< the job has succeeded already, with the images of an earlier one
  std::optional<FirstReply> replayed;
};

struct Rejection {
  enum class Reason {
    queue_full,            ///< queued jobs of all owners
    owner_queued_jobs,     ///< queued jobs of this owner
    owner_artifact_bytes,  ///< bytes of this owner's images
    disk_full,             ///< free bytes of the disk, and those kept for accepted jobs
    key_reused,            ///< the Idempotency-Key came with another request
  };
  Reason reason = Reason::queue_full;
  std::int64_t value = 0, limit = 0;
  std::int64_t added = 0;  ///< jobs of the request, for a limit of queued jobs
};

}  // namespace queue
