#pragma once
/// The database of jobs and webhook deliveries that the options name, with the images that it holds or names.

#include <memory>
#include <optional>

#include "server/daemon/config.h"
#include "server/queue/artifact_store.h"
#include "server/queue/clock.h"
#include "server/queue/cluster_store.h"
#include "server/queue/delivery_store.h"
#include "server/queue/disk_health.h"
#include "server/queue/job_store.h"
#include "server/queue/wakeups.h"
#include "server/storage/files/file_stores.h"

namespace whittled {

class JobDatabase {
 public:
  virtual ~JobDatabase() = default;
  virtual queue::Stores stores() = 0;
  virtual queue::DeliveryStore& deliveries() = 0;
  virtual queue::ArtifactStore& artifacts() = 0;
  virtual storage::files::FileArtifactStore& files() = 0;  ///< those of the artifacts that are files
  virtual queue::Clock clock() = 0;                        ///< the time of its rows
  /// The means of nodes that use it at the same time.
  struct Sharing {
    queue::ClusterStore& store;
    queue::Wakeups& wakeups;
  };
  virtual std::optional<Sharing> sharing() = 0;  ///< none: one daemon at a time
};

/// Locks the data directory. Throws StoreFailure. `health` must outlive the result.
std::unique_ptr<JobDatabase> open_database(const Config& config, queue::DiskHealth& health);

/// Throws StoreFailure if the database cannot be opened. Changes nothing.
void check_database(const Config& config);

}  // namespace whittled
