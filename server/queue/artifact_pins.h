#pragma once
/// Artifacts that may not be deleted at present.

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/queue/artifact_store.h"
#include "server/queue/event_log.h"
#include "server/queue/job_store.h"

namespace queue {

/// Prevents the deletion of bytes that a finishing job is about to name: equal images share one artifact, so the last
/// job that named it may be removed while another one has stored the same bytes but not yet its own row. Thread-safe.
/// Must outlive its Pinned.
class ArtifactPins {
 public:
  ArtifactPins(MaintenanceStore& references, ArtifactStore& artifacts, Log log)
      : references_(references), artifacts_(artifacts), log_(std::move(log)) {}

  /// See ArtifactStore::open; null also when it has another size.
  std::unique_ptr<ArtifactReader> open(const Artifact& artifact, bool verified = true);
  /// Reads it to its end, as some readers compare the bytes.
  bool is_intact(const Artifact& artifact);

  /// Deletes the bytes unless a job names them or they are pinned. Never throws: a failure costs only disk space and
  /// is logged.
  void collect(const std::string& sha256) noexcept;

  /// The artifacts that one job is about to name. They exist at least as long as this; its end collects them, unless
  /// `named` was called.
  class Pinned {
   public:
    explicit Pinned(ArtifactPins& pins) : pins_(pins) {}
    ~Pinned();
    Pinned(Pinned&&) = delete;

    /// See ArtifactStore::put; the result exists even if the same bytes are removed at the same time.
    ArtifactStore::Stored put(int fd, bool durable);

    /// Pins an existing artifact, which is durable afterwards with `sync`; false where `open` finds none, or the store
    /// is not available at present.
    bool hold(const Artifact& artifact, bool sync = false);
    bool hold(const std::vector<Artifact>& artifacts, bool sync);  ///< false if one does not exist

    /// The row that names them is stored. They are then collected only if the pin has prevented a `collect`.
    void named() { named_ = true; }

   private:
    bool pin(const std::string& sha256);  ///< false where it was pinned here before

    ArtifactPins& pins_;
    std::set<std::string> held_;
    bool named_ = false;
  };

 private:
  MaintenanceStore& references_;
  ArtifactStore& artifacts_;
  Log log_;
  std::mutex mutex_;  ///< held over the check for references and the deletion, so that no pin falls between
  struct Pin {
    int count = 0;
    bool collect = false;  ///< at the end of the last pin
  };
  std::map<std::string, Pin> pins_;
  std::atomic<std::uint64_t> removals_ = 0;  ///< changed within the mutex, after a removal
};

}  // namespace queue
