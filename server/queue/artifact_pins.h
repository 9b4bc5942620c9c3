#pragma once
/// Keeps removal from deleting bytes that a finishing job is about to name: equal images share one artifact, so the
/// last job that named it may be removed while another one is between storing the same bytes and its own row. And knows
/// both places where images are: small ones in the JobStore, stored by their job's end itself, the others in the
/// ArtifactStore.

#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "server/queue/artifact_store.h"
#include "server/queue/event_log.h"
#include "server/queue/job_store.h"

namespace queue {

/// Thread-safe. Must outlive its Pinned.
class ArtifactPins {
 public:
  ArtifactPins(JobStore& store, ArtifactStore& artifacts, std::size_t small_bytes, Log log)
      : store_(store), artifacts_(artifacts), small_bytes_(small_bytes), log_(std::move(log)) {}

  std::unique_ptr<ArtifactReader> open(const std::string& sha256);  ///< null when not there

  /// Deletes the bytes unless a job names them or they are pinned. Never throws: what cannot be deleted now only costs
  /// space, and is logged.
  void collect(const std::string& sha256) noexcept;

  /// The artifacts one job is about to name. Until this is gone they stay; then those that no job names are deleted.
  class Pinned {
   public:
    explicit Pinned(ArtifactPins& pins) : pins_(pins) {}
    ~Pinned();
    Pinned(const Pinned&) = delete;
    Pinned& operator=(const Pinned&) = delete;

    /// As ArtifactStore::put, and there when it returns, whoever removes the same bytes meanwhile, unless it is small:
    /// then it comes with the rows.
    ArtifactStore::Stored put(int fd);

    /// Keeps an artifact that is there already; false where it is not.
    bool hold(const std::string& sha256);

   private:
    ArtifactPins& pins_;
    std::vector<std::string> held_;
  };

 private:
  JobStore& store_;
  ArtifactStore& artifacts_;
  const std::size_t small_bytes_;
  Log log_;
  std::mutex mutex_;  ///< held over "does a job name it?" and the deletion, so that no pin falls between
  std::map<std::string, int> pins_;
};

}  // namespace queue
