#pragma once
/// Deletes uploaded assets that no job names and nobody has used for a while, a little at a time.
///
/// Whoever accepts a job asks AssetStore::use for what it names, then stores the job with those names. Between the two
/// an asset is young, afterwards it is named; the collector deletes only what is neither, so it never takes from a job
/// what that still needs, as long as accepting takes less than the age.

#include <chrono>

#include "server/queue/asset_store.h"
#include "server/queue/clock.h"
#include "server/queue/job_store.h"
#include "server/queue/periodic_task.h"

namespace queue {

struct CollectorSettings {
  std::chrono::milliseconds age{std::chrono::days(30)};  ///< unused for longer, it may go
  std::chrono::milliseconds step_pause{20};              ///< a part of the store at a time, so a round takes 5 s
  std::chrono::milliseconds round_pause{std::chrono::hours(1)};  ///< ages are days: nobody misses an hour
};

/// Looks through one part of the store (0 <= `part` < AssetStore::parts); how many it deleted. Throws StoreFailure.
int collect_assets(AssetStore& assets, JobStore& store, int part, std::int64_t unused_since);

/// A thread that does so, round after round from the start on; a part that cannot be looked through is left to the next
/// round. The stores must outlive it.
class AssetCollector {
 public:
  AssetCollector(AssetStore& assets, JobStore& store, Clock clock, const Log& log, CollectorSettings settings);

 private:
  std::chrono::milliseconds step(const Log& log);

  AssetStore& assets_;
  JobStore& store_;
  Clock clock_;
  CollectorSettings settings_;
  int part_ = 0;         ///< the next one
  PeriodicTask thread_;  ///< last: starts when the rest is there
};

}  // namespace queue
