#pragma once
/// The contract of the stores of jobs, run against every implementation in store_kinds().

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tests/conformance/temporary_directory.h"
#include "tests/conformance/test_store.h"
#include "tests/support/threads.h"

namespace queue {

/// The fields that most differences of two jobs show in.
inline void PrintTo(const Job& job, std::ostream* out) {
  *out << job.id << " of " << job.owner << ", " << job.name << ": " << name_of(job.state) << ", attempt " << job.attempt
       << ", revision " << job.revision << ", started " << job.started_at.value_or(-1) << ", ended "
       << job.ended_at.value_or(-1) << ", not before " << job.not_before.value_or(-1) << ", work " << job.work
       << ", report " << job.report << ", " << job.labels.size() << " labels, " << job.assets.size() << " assets, "
       << job.artifacts.size() << " artifacts";
}

}  // namespace queue

/// One kind of store with a place for its data.
class StoreUnderTest {
 public:
  virtual ~StoreUnderTest() = default;
  virtual StoreCalls& store() = 0;
  /// As another process on the same data, where the store permits it.
  virtual StoreCalls& other_node() { return store(); }
  /// As a daemon that ends and starts again.
  virtual void reopen() = 0;
  /// Several processes may use it at once.
  [[nodiscard]] virtual bool is_shared() const { return false; }
};

struct StoreKind {
  std::string name;
  std::function<std::unique_ptr<StoreUnderTest>()> make;
};
std::vector<StoreKind> store_kinds();

class JobStoreConformance : public testing::TestWithParam<StoreKind> {
 protected:
  StoreCalls& store() { return under_test_->store(); }
  std::array<StoreCalls*, 2> nodes() { return {&store(), &under_test_->other_node()}; }
  void reopen() { under_test_->reopen(); }
  [[nodiscard]] bool is_shared() const { return under_test_->is_shared(); }

  queue::Job new_job();  ///< it is not stored; ids grow with every call
  /// Submits a job with defaults except for `change`; returns its id.
  std::string submit(const std::function<void(queue::Job&)>& change = {}, const std::string& document = "{}");
  queue::Claim claim(bool alone = false);  ///< under boot id "boot" at time `now`
  /// Claims the next job and ends it; returns it as claimed.
  queue::Job succeed_next(const std::vector<queue::Artifact>& artifacts = {});
  queue::Job fail_next();
  queue::Job find(const std::string& id);
  std::vector<std::string> list(const queue::JobFilter& filter = {}, int limit = 100);

  /// A job brought to a state: running ones with the claim that runs them.
  struct Placed {
    std::string id;
    std::int64_t fence = 0;
  };
  Placed place(queue::JobState state);
  /// Every call that ends the queued job of an id, by name. All other jobs must have ended.
  std::vector<std::pair<std::string, std::function<void(const std::string& id)>>> ends();

  std::int64_t now = 1'000'000;
  const std::int64_t lease_end = 5'000'000;  ///< end of the lease of every claim

 private:
  std::unique_ptr<StoreUnderTest> under_test_ = GetParam().make();
  int submitted_ = 0;
};
