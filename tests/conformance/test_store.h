#pragma once
/// The calls of all stores of a directory under one name, and the stores of a temporary directory, for tests.

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/queue/asset_store.h"
#include "server/storage/files/file_stores.h"
#include "server/storage/sqlite/sqlite_stores.h"
#include "tests/conformance/temporary_directory.h"

/// As queue::Stores, with names that differ where two stores have the same.
class StoreCalls {
 public:
  explicit StoreCalls(const queue::Stores& all) : all_(all) {}

  /// The earlier reply, if there is one.
  auto insert(const queue::InsertRequest& request, std::int64_t now) { return all_.jobs.insert(request, now); }
  void submit(const queue::Job& job, const std::string& document) { insert({{{job, document}}}, job.created_at); }
  auto find_reply(const queue::ReplyKey& key, std::int64_t now) { return all_.jobs.find_reply(key, now); }
  auto find(const std::string& id) { return all_.jobs.find(id); }
  auto find_by_content_key(const std::string& key, std::int64_t t) { return all_.jobs.find_by_content_key(key, t); }
  auto moves(const std::string& id) { return all_.jobs.moves(id); }
  auto document(const std::string& id) { return all_.jobs.document(id); }
  auto scene(const std::string& id) { return all_.jobs.scene(id); }
  auto list(const queue::JobFilter& filter, const std::string& cursor, int limit) {
    return all_.jobs.list(filter, cursor, limit);
  }
  auto change(const std::string& id, const queue::JobChange& change, std::optional<std::int64_t> revision) {
    return all_.jobs.change(id, change, revision);
  }
  auto remove(const std::string& id) { return all_.jobs.remove(id); }

  auto count(queue::JobState state) { return all_.statistics.count(state); }
  auto owner_usage(const std::string& owner) { return all_.statistics.owner_usage(owner); }
  auto depth() { return all_.statistics.depth(); }
  std::optional<std::int64_t> queue_position(const std::string& id, std::int64_t limit) {
    const auto before = all_.statistics.queue_position(id, limit);
    return before ? std::optional(before->jobs) : std::nullopt;
  }
  auto work_before(const std::string& id) { return all_.statistics.queue_position(id, 1000).value().work; }

  auto claim(const std::string& boot_id, std::int64_t now, std::int64_t lease_until, bool suspects,
             bool small = false) {
    return all_.transitions.claim({boot_id, lease_until}, now, {.suspects = suspects, .small = small});
  }
  auto claim(const queue::ClaimTerms& terms, std::int64_t now, const queue::ClaimFilter& filter) {
    return all_.transitions.claim(terms, now, filter);
  }
  auto renew(const std::vector<queue::Lease>& leases, std::int64_t until) {
    return all_.transitions.renew(leases, until);
  }
  bool succeed(const std::string& id, std::int64_t fence, std::int64_t now, const std::string& report,
               const std::vector<queue::Artifact>& artifacts, bool durable = true) {
    return all_.transitions.succeed(id, fence, now, report, artifacts, durable);
  }
  bool fail(const std::string& id, std::int64_t fence, std::int64_t now, const queue::Problem& problem) {
    return all_.transitions.fail(id, fence, now, problem);
  }
  bool add_artifact(const std::string& id, std::int64_t fence, const queue::Artifact& artifact) {
    return all_.transitions.add_artifact(id, fence, artifact);
  }
  bool finish_cancel(const std::string& id, std::int64_t fence, std::int64_t now) {
    return all_.transitions.finish_cancel(id, fence, now);
  }
  bool release(const std::string& id, std::int64_t fence, std::int64_t now, const queue::Release& release) {
    return all_.transitions.release(id, fence, now, release) != queue::ReleaseOutcome::stale;
  }
  auto cancel(const std::string& id, std::int64_t now) { return all_.transitions.cancel(id, now); }
  auto retry(const std::string& id, std::int64_t now) { return all_.transitions.retry(id, now); }

  auto find_batch(const std::string& id) { return all_.batches.find(id); }
  auto cancel_batch(const std::string& id, std::int64_t now) { return all_.batches.cancel(id, now); }
  auto retry_batch(const std::string& id, std::int64_t now) { return all_.batches.retry(id, now); }
  auto list_batches(const std::string& cursor, int limit) { return all_.batches.list(cursor, limit); }
  auto remove_ended(const std::string& id, int limit) { return all_.batches.remove_ended(id, limit); }
  auto failing_batches() { return all_.batches.list_failing(); }

  auto run_maintenance(std::int64_t now, std::int64_t expired_ms, int limit) {
    return all_.maintenance.run_maintenance(now, {.expired_ms = expired_ms}, limit);
  }
  auto run_maintenance(std::int64_t now, const queue::Retention& retention, int limit) {
    return all_.maintenance.run_maintenance(now, retention, limit);
  }
  int recover(const std::string& boot_id, std::int64_t now) { return all_.maintenance.recover(boot_id, now); }
  bool is_artifact_referenced(const std::string& sha256) { return all_.maintenance.is_artifact_referenced(sha256); }
  bool is_asset_referenced(const std::string& sha256) { return all_.maintenance.is_asset_referenced(sha256); }
  void probe() { all_.maintenance.probe(); }

  [[nodiscard]] const queue::Stores& all() const { return all_; }

 private:
  const queue::Stores all_;
};

/// The stores of a directory.
class TestStore : public StoreCalls {
 public:
  explicit TestStore(const std::string& directory, storage::sqlite::SqliteSettings settings = {})
      : TestStore(std::make_unique<storage::sqlite::SqliteStores>(directory, settings)) {}

  [[nodiscard]] const storage::sqlite::SqliteStores& sqlite() const { return *sqlite_; }

 private:
  explicit TestStore(std::unique_ptr<storage::sqlite::SqliteStores> sqlite)
      : StoreCalls(sqlite->all()), sqlite_(std::move(sqlite)) {}

  std::unique_ptr<storage::sqlite::SqliteStores> sqlite_;
};

inline std::string numbered_id(int number) {
  const std::string digits = std::to_string(number);
  return "0190a5b0-0000-7000-8000-" + std::string(12 - digits.size(), '0') + digits;
}

inline queue::Job job_named(const std::string& id) {
  queue::Job job;
  job.id = id;
  return job;
}

struct Failure {
  std::optional<queue::StoreFailure::Kind> kind;  ///< none: the call returned
  std::string what;
};

template <class Call>
Failure failure_of(const Call& call) {
  try {
    call();
  } catch (const queue::StoreFailure& failure) {
    return {failure.kind, failure.what()};
  }
  return {};
}

/// All bytes, read in steps; none without a reader.
inline std::optional<std::string> bytes_of(const std::unique_ptr<queue::ArtifactReader>& reader) {
  if (reader == nullptr) return std::nullopt;
  std::string bytes(reader->size_bytes(), '?');
  for (std::size_t done = 0, count = 1; done < bytes.size() && count > 0; done += count)
    count = reader->read(done, bytes.data() + done, std::min<std::size_t>(100'000, bytes.size() - done));
  return bytes;
}

/// Bytes that differ everywhere, more than any store keeps as a row.
inline std::string large_bytes() {
  std::string bytes;
  for (std::uint32_t i = 0; i < 1'500'000; ++i) bytes.push_back(static_cast<char>(i * 2654435761u >> 24));
  return bytes;
}

/// Reads bytes that outlive it.
inline queue::AssetStore::Read reading(const std::string& bytes) {
  return [&bytes](std::uint64_t offset, char* into, std::size_t size) {
    return offset < bytes.size() ? bytes.copy(into, size, offset) : 0;
  };
}

/// Stores of one test in a temporary directory, without syncs of the database by default.
struct TemporaryStores {
  storage::sqlite::SqliteSettings settings{.synchronous = false};
  TemporaryDirectory directory{};
  TestStore store{directory.path(), settings};
  storage::files::FileArtifactStore large_artifacts{directory.path()};
  storage::sqlite::SmallArtifactStore artifacts{store.sqlite(), large_artifacts};
};
