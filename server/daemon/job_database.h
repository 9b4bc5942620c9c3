#pragma once
/// The database of jobs and webhook deliveries that the options name, with its images and uploads.

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "server/daemon/config.h"
#include "server/daemon/shared_files.h"
#include "server/queue/artifact_store.h"
#include "server/queue/asset_store.h"
#include "server/queue/clock.h"
#include "server/queue/cluster_store.h"
#include "server/queue/delivery_store.h"
#include "server/queue/disk_health.h"
#include "server/queue/event_log.h"
#include "server/queue/job_store.h"
#include "server/queue/task_store.h"
#include "server/queue/wakeups.h"
#include "server/storage/objects/asset_cache.h"

namespace whittled {

class JobDatabase {
 public:
  virtual ~JobDatabase() = default;
  virtual queue::Stores stores() = 0;
  virtual queue::DeliveryStore& deliveries() = 0;
  virtual queue::ArtifactStore& artifacts() = 0;
  virtual queue::Clock clock() = 0;  ///< the time of its rows
  /// The means of nodes that use it at the same time.
  struct Sharing {
    queue::ClusterStore& store;
    queue::Wakeups& wakeups;
    queue::TaskStore& tasks;
  };
  virtual std::optional<Sharing> sharing() = 0;  ///< none: one daemon at a time
  virtual queue::AssetStore& assets() = 0;
  /// One small step of the search for damaged images, or of the removal of those that no job names; returns the pause
  /// before the next one. One thread.
  virtual std::chrono::milliseconds maintain_artifacts(const queue::Log& log) = 0;
  /// Images and uploads that other nodes use too; null: they are in the data directory.
  virtual SharedFiles* shared_files() { return nullptr; }
  virtual storage::objects::AssetCache* asset_cache() { return nullptr; }  ///< copies of the shared uploads
};

/// Directory of the uploads, or of their copies on this node.
std::string uploads_directory(const Config& config);

/// Locks the data directory. Throws StoreFailure. `node` is a unique name of this process. `health` must outlive the
/// result.
std::unique_ptr<JobDatabase> open_database(const Config& config, const std::string& node, queue::DiskHealth& health);

/// Throws StoreFailure if the database cannot be opened. Changes nothing.
void check_database(const Config& config);

}  // namespace whittled
