#pragma once
/// A queue on stores in a temporary directory, with the clock of the test.

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/queue/queue.h"
#include "tests/conformance/memory_file.h"
#include "tests/conformance/test_store.h"

/// Events of the log, counted by name.
class RecordedLog {
 public:
  queue::Log log() {
    return [this](queue::LogLevel, std::string_view event, const queue::LogFields& fields) {
      const std::lock_guard lock(mutex_);
      std::string& lines = lines_[std::string(event)];
      for (const auto& [key, value] : fields) lines.append(key).append("=").append(value).append(" ");
      ++counts_[std::string(event)];
    };
  }
  int count(const std::string& event) {
    const std::lock_guard lock(mutex_);
    return counts_[event];
  }
  std::string fields(const std::string& event) {
    const std::lock_guard lock(mutex_);
    return lines_[event];
  }

 private:
  std::mutex mutex_;
  std::map<std::string, int> counts_;
  std::map<std::string, std::string> lines_;
};

/// Calls of the test within those of the stores.
struct StoreHooks {
  std::string failing;  ///< the call that fails, as on a full disk: insert, succeed or probe
  std::atomic<int> failing_results = 0, failing_claims = 0;  ///< so many calls of succeed or claim fail first
  std::function<void()> after_limited_claim;                 ///< called once, within a claim that excludes owners
  std::function<void()> after_suspect_claim;                 ///< called once, within a claim of suspects
  std::function<void(std::string_view call, bool durable)> before = [](std::string_view, bool) {};
  std::function<void()> after = [] {};  ///< the call has had its effect
  std::atomic<std::size_t> renewals = 0, leases_max = 0;

  void begin(std::string_view call, bool durable) const {
    if (call == failing) throw queue::StoreFailure(queue::StoreFailure::Kind::full, "disk full");
    before(call, durable);
  }
};

class HookedJobs final : public queue::JobStore {
 public:
  HookedJobs(const queue::JobStore& target, StoreHooks& hooks) : JobStore(target), hooks_(hooks) {}
  std::optional<queue::KeptReply> insert(const queue::InsertRequest& request, std::int64_t now) override {
    hooks_.begin("insert", request.durable);
    auto result = JobStore::insert(request, now);
    hooks_.after();
    return result;
  }

 private:
  StoreHooks& hooks_;
};

class HookedTransitions final : public queue::JobTransitions {
 public:
  HookedTransitions(const queue::JobTransitions& target, StoreHooks& hooks) : JobTransitions(target), hooks_(hooks) {}
  bool succeed(const std::string& id, std::int64_t fence, std::int64_t now, const std::string& report,
               const std::vector<queue::Artifact>& artifacts, bool durable, bool rendered) override {
    hooks_.begin("succeed", durable);
    if (hooks_.failing_results-- > 0) throw queue::StoreFailure(queue::StoreFailure::Kind::full, "disk full");
    return JobTransitions::succeed(id, fence, now, report, artifacts, durable, rendered);
  }
  std::optional<queue::Claim> claim(const queue::ClaimTerms& terms, std::int64_t now,
                                    const queue::ClaimFilter& filter) override {
    if (hooks_.failing_claims-- > 0) throw queue::StoreFailure(queue::StoreFailure::Kind::unavailable, "I/O error");
    std::optional<queue::Claim> claim = JobTransitions::claim(terms, now, filter);
    if (!filter.busy_owners.empty() && hooks_.after_limited_claim) std::exchange(hooks_.after_limited_claim, nullptr)();
    if (filter.suspects && hooks_.after_suspect_claim) std::exchange(hooks_.after_suspect_claim, nullptr)();
    return claim;
  }
  queue::ReleaseOutcome release(const std::string& id, std::int64_t fence, std::int64_t now,
                                const queue::Release& how) override {
    const queue::ReleaseOutcome released = JobTransitions::release(id, fence, now, how);
    hooks_.after();
    return released;
  }
  std::vector<queue::Lease> renew(const std::vector<queue::Lease>& leases, std::int64_t until) override {
    hooks_.leases_max = std::max(hooks_.leases_max.load(), leases.size());
    ++hooks_.renewals;
    return JobTransitions::renew(leases, until);
  }

 private:
  StoreHooks& hooks_;
};

class HookedMaintenance final : public queue::MaintenanceStore {
 public:
  HookedMaintenance(const queue::MaintenanceStore& target, StoreHooks& hooks)
      : MaintenanceStore(target), hooks_(hooks) {}
  void probe() override { hooks_.begin("probe", true); }
  queue::MaintenanceResult run_maintenance(std::int64_t now, const queue::Retention& retention, int limit) override {
    queue::MaintenanceResult result = MaintenanceStore::run_maintenance(now, retention, limit);
    hooks_.after();
    return result;
  }

 private:
  StoreHooks& hooks_;
};

class RecordingRunner final : public queue::JobRunner {
 public:
  void notify(bool) noexcept override { ++notifications; }
  void cancel(const std::string& id) noexcept override { cancelled.push_back(id); }
  void request_preview(const std::string& id, std::uint32_t side) noexcept override {
    preview_requests.push_back(id + " " + std::to_string(side));
  }
  void on_lease_lost(const queue::Lease& lease) noexcept override { lost_leases.push_back(lease); }
  std::string not_ready() override { return status; }
  std::atomic<int> notifications = 0;  // several threads submit at the same time
  std::vector<std::string> cancelled, preview_requests;
  std::vector<queue::Lease> lost_leases;
  std::string status;
};

class QueueFixture : public testing::Test {
 protected:
  explicit QueueFixture(const queue::QueueSettings& with = {}) : queue_settings(with) {}

  std::string submit(const std::string& document = "{}") {
    return submit_job(document, [](queue::Job&) {});
  }
  std::string submit_job(const std::string& document, const std::function<void(queue::Job&)>& change) {
    queue::Job job;
    change(job);
    return queue.submission.submit({.document = document, .job = std::move(job)})->view.job.id;
  }
  queue::Claim submit_and_claim() {
    (void)submit();
    return queue.lifecycle.claim().value();
  }
  bool succeed(const queue::Claim& claim, const std::string& image) {
    const MemoryFile file(image);
    return queue.lifecycle.succeed(claim.job.id, claim.fence, "{}", {{"image.png", "image/png", file.fd()}});
  }
  queue::JobView find(const std::string& id) { return queue.queries.find(id).value(); }
  queue::JobState state(const std::string& id) { return find(id).job.state; }

  std::atomic<std::int64_t> now = 1'700'000'000'000;  ///< 0: that of the system
  const queue::Clock clock = [this] {
    const std::int64_t set = now;
    return set != 0 ? set : queue::system_clock()();
  };
  const queue::QueueSettings queue_settings;
  RecordedLog log;
  StoreHooks hooks;
  TemporaryStores temporary;
  TestStore& store = temporary.store;
  HookedJobs jobs{store.all().jobs, hooks};
  HookedTransitions transitions{store.all().transitions, hooks};
  HookedMaintenance maintenance{store.all().maintenance, hooks};
  const queue::Stores stores{jobs, store.all().statistics, transitions, store.all().batches, maintenance};
  queue::IdSource ids{clock, queue::system_random()};
  queue::Queue queue{stores, temporary.artifacts, ids, clock, log.log(), queue_settings};
};
