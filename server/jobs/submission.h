#pragma once
/// What a client hands in to the queue, what comes of it, and why it may be refused: plain values.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "api/document.h"
#include "server/jobs/job.h"

namespace jobs {

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
  auto operator<=>(const ReplyKey&) const = default;
};

/// The wish to have a request done once, however often it comes.
struct Idempotency {
  std::string route;           ///< "POST /v1/jobs"
  std::string key;             ///< as the client chose it
  std::string request_sha256;  ///< tells other requests under the same key
};

struct Submission {
  std::string document = {};  ///< kept verbatim
  api::Document parsed = {};  ///< what api::parse_scene made of it
  std::string owner = {};     ///< name of the API key; empty without keys
  /// What tells pictures apart: the canonical document's sha256, the files' and the build's. Empty: the result cache
  /// has nothing to do with it.
  std::string content_key = {};
  std::optional<Idempotency> idempotency = std::nullopt;
  /// Called before the job is stored when there is `idempotency`: both are stored together.
  std::function<FirstReply(const JobView& view, bool from_cache)> write_reply = nullptr;
};

struct Submitted {
  JobView view;             ///< of a replay: nothing
  bool from_cache = false;  ///< the job has succeeded already, with pictures made before
  std::optional<FirstReply> replayed;
};

struct Refused {
  enum class Why {
    queue_full,            ///< queued jobs of all
    owner_queued_jobs,     ///< queued jobs of this owner
    owner_artifact_bytes,  ///< bytes of this owner's pictures
    key_reused,            ///< the Idempotency-Key came with another request
  };
  Why why = Why::queue_full;
  std::int64_t seen = 0, limit = 0;
};

}  // namespace jobs
