#pragma once
/// What a client hands in to the queue, what comes of it, and why it may be refused: plain values.

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "api/document.h"
#include "server/queue/job.h"

namespace queue {

/// A job and what only the running daemon knows of it.
struct JobView {
  Job job;
  double progress = 0;  ///< tiles done / tiles; 1 when succeeded
  /// 1 for the next to run; unknown where it does not wait, must not run yet, or has more than 1000 before it.
  std::optional<std::int64_t> queue_position = std::nullopt;
};

/// The first reply to a request, to be given again. Opaque to the queue.
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

/// The wish to have a request done once, however often it comes.
struct Idempotency {
  std::string route;           ///< "POST /v1/jobs"
  std::string key;             ///< as the client chose it
  std::string request_sha256;  ///< tells other requests under the same key
};

struct Submission {
  JobKind kind = JobKind::render;
  std::string document = {};  ///< kept verbatim
  api::Document parsed = {};  ///< what api::parse_scene made of it
  std::string accuracy = {};  ///< see Job
  std::string owner = {};     ///< name of the API key; empty without keys
  /// What tells images apart: the canonical document's sha256, the files' and the build's. Empty: the result cache
  /// has nothing to do with it.
  std::string content_key = {};
  std::optional<Idempotency> idempotency = std::nullopt;
  /// False: its submitter waits for the images and was promised nothing else. Then the job survives the death of the
  /// daemon, but power loss only from JobService::make_durable, or the next durable write of any job, on.
  bool durable = true;
  /// Called before the job is stored when there is `idempotency`: both are stored together.
  std::function<FirstReply(const JobView& view, bool from_cache)> write_reply = nullptr;
};

/// Jobs that come together and are stored together or not at all.
struct Batch {
  std::string id;  ///< UUIDv7
  std::string owner;
  std::string name;
  std::int64_t created_at = 0;
  std::optional<int> max_failed;  ///< with more failed jobs than this the rest is cancelled; unset: never
  int size = 0;                   ///< jobs it began with
};

/// A batch and what became of its jobs, those not counted that were removed.
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
  BatchState state;  ///< of a replay: nothing
  std::optional<FirstReply> replayed;
};

struct Submitted {
  JobView view;             ///< of a replay: nothing
  bool from_cache = false;  ///< the job has succeeded already, with images made before
  std::optional<FirstReply> replayed;
};

struct Refused {
  enum class Why {
    queue_full,            ///< queued jobs of all
    owner_queued_jobs,     ///< queued jobs of this owner
    owner_artifact_bytes,  ///< bytes of this owner's images
    disk_full,             ///< bytes that are free on the disk, and that are kept for what was accepted
    key_reused,            ///< the Idempotency-Key came with another request
  };
  Why why = Why::queue_full;
  std::int64_t seen = 0, limit = 0;
};

}  // namespace queue
