#pragma once
/// Submissions to the queue, their results and the reasons of rejections: plain values.

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "api/document.h"
#include "server/queue/job.h"

namespace queue {

/// A job with the facts that only the running daemon has.
struct JobView {
  Job job;
  double progress = 0;  ///< tiles done / tiles; 1 when succeeded
  /// 1 for the next to run; empty where it is not queued, has a not_before, or has more than 1000 before it.
  std::optional<std::int64_t> queue_position = std::nullopt;
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
  JobKind kind = JobKind::render;
  std::string document = {};  ///< kept verbatim
  api::Document parsed = {};  ///< its result of api::parse_scene
  std::string accuracy = {};  ///< see Job
  std::string owner = {};     ///< name of the API key; empty without keys
  /// Identifies the images: sha256 of the canonical document, the files and the build. Empty: not in the result cache.
  std::string content_key = {};
  std::optional<Idempotency> idempotency = std::nullopt;
  /// False: the client waits for the images and has no id yet. The job then survives the death of the daemon, but
  /// power loss only from JobSubmission::make_durable, or the next durable write of any job, on.
  bool durable = true;
  /// Called before the job is stored when there is `idempotency`: both are stored together.
  std::function<FirstReply(const JobView& view, bool from_cache)> write_reply = nullptr;
};

/// Jobs that are submitted together and stored together or not at all.
struct Batch {
  std::string id;  ///< UUIDv7
  std::string owner;
  std::string name;
  std::int64_t created_at = 0;
  std::optional<int> max_failed;  ///< with more failed jobs than this the rest is cancelled; unset: never
  int size = 0;                   ///< number of jobs at first
};

/// A batch and the states of its jobs that were not removed.
struct BatchState {
  Batch batch;
  std::map<JobState, std::int64_t> jobs;
};

struct BatchSubmission {
  std::vector<Submission> jobs;  ///< at least one; without idempotency of their own
  std::string name, owner;
  std::optional<int> max_failed;
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
};

}  // namespace queue
