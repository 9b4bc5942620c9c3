#pragma once
/// The connections of SqliteStores, which its stores share, and the stores themselves. Private to this directory.

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/queue/disk_health.h"
#include "server/storage/sqlite/group_commit.h"
#include "server/storage/sqlite/sqlite_stores.h"

namespace storage::sqlite {

/// Prevents a second daemon on a data directory: an exclusive lock (flock) on DIRECTORY/lock, a file with the process
/// id of the holder. The kernel releases it when the process ends.
class DirectoryLock {
 public:
  /// Time to wait for a lock that another process holds: a killed daemon may need a moment to end.
  static constexpr std::chrono::seconds patience{3};

  /// Creates the directory where missing. Throws StoreFailure, with the process id of another holder.
  explicit DirectoryLock(const std::string& directory);
  ~DirectoryLock();
  DirectoryLock(const DirectoryLock&) = delete;
  DirectoryLock& operator=(const DirectoryLock&) = delete;

 private:
  int fd_ = -1;
};

/// A few read-only connections, each used by one caller at a time.
class ReadPool {
 public:
  ReadPool(const std::string& path, int connections) {
    for (int i = 0; i < connections; ++i) {
      idle_.push_back(std::make_unique<Database>(path, Database::Access::read_only));
    }
  }

  /// `read(database)` reads one state of the file with every write that returned before. Waits for a free connection.
  template <class Read>
  auto run(Read read) {
    Loan loan(*this);
    loan.database->change("BEGIN");
    return read(*loan.database);
  }

 private:
  struct Loan {
    explicit Loan(ReadPool& from) : pool(from) {
      std::unique_lock lock(pool.mutex_);
      pool.returned_.wait(lock, [&] { return !pool.idle_.empty(); });
      database = std::move(pool.idle_.back());
      pool.idle_.pop_back();
    }
    ~Loan() {
      try {
        if (database->in_transaction()) database->change("COMMIT");
      } catch (...) {
        // Nothing was written; the next BEGIN throws.
      }
      const std::lock_guard lock(pool.mutex_);
      pool.idle_.push_back(std::move(database));
      pool.returned_.notify_one();
    }
    Loan(const Loan&) = delete;
    Loan& operator=(const Loan&) = delete;
    ReadPool& pool;
    std::unique_ptr<Database> database;
  };

  std::mutex mutex_;
  std::condition_variable returned_;
  std::vector<std::unique_ptr<Database>> idle_;
};

/// In the order of dependence: the lock is released last, the readers are closed before the writer, which checkpoints.
struct Connections {
  Connections(const std::string& directory, const SqliteSettings& settings);
  DirectoryLock lock;
  queue::DiskHealth own_health;
  GroupCommit writer;
  ReadPool reader;
};

/// The connections must outlive the stores.
std::unique_ptr<queue::JobStore> make_job_store(Connections& connections);
std::unique_ptr<queue::JobStatistics> make_job_statistics(Connections& connections);
std::unique_ptr<queue::JobTransitions> make_job_transitions(Connections& connections);
std::unique_ptr<queue::BatchStore> make_batch_store(Connections& connections);
std::unique_ptr<queue::MaintenanceStore> make_maintenance_store(Connections& connections);

}  // namespace storage::sqlite
