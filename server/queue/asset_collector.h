#pragma once
/// Deletes uploaded assets that no job names and that were not used for some time, a few at a time.
///
/// A submission calls AssetStore::use for its assets, then stores the job with their names. Between the two an asset
/// is young, afterwards it is named; the collector deletes only assets that are neither, so it never deletes one that a
/// job needs, as long as a submission takes less than the age.

#include <chrono>

#include "server/queue/asset_store.h"
#include "server/queue/clock.h"
#include "server/queue/job_store.h"
#include "server/queue/periodic_task.h"

namespace queue {

struct CollectorSettings {
  std::chrono::milliseconds age{std::chrono::days(30)};  ///< assets unused for longer are deleted
  std::chrono::milliseconds step_pause{20};              ///< one part of the store at a time, so a round takes 5 s
  std::chrono::milliseconds round_pause{std::chrono::hours(1)};
};

/// Collects in one part of the store (0 <= `part` < AssetStore::parts); number of deleted assets. Throws StoreFailure.
int collect_assets(AssetStore& assets, MaintenanceStore& references, int part, std::int64_t unused_since);

/// A thread that collects round after round; a part that fails is left to the next round. The stores must outlive it.
class AssetCollector {
 public:
  AssetCollector(AssetStore& assets, MaintenanceStore& references, Clock clock, const Log& log,
                 CollectorSettings settings);

 private:
  std::chrono::milliseconds step(const Log& log);

  AssetStore& assets_;
  MaintenanceStore& references_;
  Clock clock_;
  CollectorSettings settings_;
  int part_ = 0;         ///< the next one
  PeriodicTask thread_;  ///< last: it uses all other members
};

}  // namespace queue
