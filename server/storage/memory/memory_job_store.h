#pragma once
/// A JobStore for tests: everything in this process's memory, nothing survives it. Otherwise it keeps every promise of
/// the port and passes the same conformance suite. Tests derive from it to make it fail.

#include <cstdint>
#include <map>
#include <mutex>
#include <string>

#include "server/jobs/job_store.h"

namespace jobs {

class MemoryJobStore : public JobStore {
 public:
  void submit(const Job& job, const std::string& document) override;
  std::optional<Job> find(const std::string& id) override;
  std::optional<std::string> document(const std::string& id) override;
  JobPage list(const JobFilter& filter, const std::string& cursor, int limit) override;
  std::int64_t count(JobState state) override;
  std::optional<Claim> claim(const std::string& boot_id, std::int64_t now, bool alone) override;
  bool succeed(const std::string& id, std::int64_t fence, std::int64_t now, const std::string& report,
               const std::vector<Artifact>& artifacts) override;
  bool fail(const std::string& id, std::int64_t fence, std::int64_t now, const Problem& problem) override;
  bool finish_cancel(const std::string& id, std::int64_t fence, std::int64_t now) override;
  bool release(const std::string& id, std::int64_t fence, std::int64_t now, bool counts, bool suspect) override;
  CancelOutcome cancel(const std::string& id, std::int64_t now) override;
  Removal remove(const std::string& id) override;
  int recover(const std::string& boot_id, std::int64_t now) override;
  bool references(const std::string& sha256) override;
  bool names_asset(const std::string& sha256) override;
  void probe() override {}

 private:
  struct Row {
    Job job;
    std::string document;
    std::int64_t fence = 0;
    std::string boot_id;
  };
  Row* running(const std::string& id, std::int64_t fence);

  std::mutex mutex_;
  std::map<std::string, Row> rows_;  ///< by id, so by creation
};

}  // namespace jobs
