#pragma once
/// The connections to the SQLite files, which the stores share. Private to this directory.

#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/queue/disk_health.h"
#include "server/storage/files/directory_lock.h"
#include "server/storage/sqlite/database.h"
#include "server/storage/sqlite/sqlite_stores.h"

namespace storage::sqlite {

/// All writes of the process through one connection (group commit). A caller that finds the connection idle commits at
/// once on its own thread: a hand-over costs more than most commits. Operations that arrive meanwhile wait, and one of
/// their threads commits all of them with one sync.
class GroupCommit : public sql::Transactions {
 public:
  /// `health` must outlive this. No call may be in progress at the destruction.
  GroupCommit(std::unique_ptr<SqliteDatabase> database, queue::DiskHealth& health)
      : database_(std::move(database)), health_(health) {}

 private:
  /// An exception of `work` undoes its own writes alone and is thrown here.
  void run_write(const Run& work, sql::Synced synced) final {
    Operation operation{work, synced, nullptr, false, {}};
    health_.run([&] { wait_for(operation); });
  }
  void run_read(const Run& work) override { run_write(work, sql::Synced::with_next); }

  struct Operation {
    const Run& work;
    sql::Synced synced = sql::Synced::now;
    std::exception_ptr failure;
    bool done = false;
    std::condition_variable turn;  ///< it is done, or may lead
  };

  void wait_for(Operation& operation);
  void lead(std::unique_lock<std::mutex>& lock);
  void commit(const std::vector<Operation*>& group) noexcept;
  bool run_in_savepoint(Operation& operation);
  void undo() noexcept;

  std::unique_ptr<SqliteDatabase> database_;  ///< used by the committing thread
  queue::DiskHealth& health_;
  std::mutex mutex_;
  std::vector<Operation*> waiting_;
  bool led_ = false;  ///< a thread is committing
};

/// Run on every connection to the jobs: names that the stores read and other databases have as views of several tables.
inline constexpr const char* jobs_views = "CREATE TEMP VIEW owners AS SELECT * FROM owner_usage";

/// A few read-only connections, each used by one caller at a time.
class ReadPool {
 public:
  ReadPool(const std::string& path, int connections) {
    for (int i = 0; i < connections; ++i) {
      idle_.push_back(std::make_unique<SqliteDatabase>(path, SqliteDatabase::Access::read_only));
      idle_.back()->script(jobs_views);
    }
  }

  /// `read(database)` reads one state of the file with every write that returned before. Waits for a free connection.
  void run(const std::function<void(sql::Database&)>& read) {
    const Loan loan(*this);
    loan.database->change("BEGIN");
    read(*loan.database);
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
    Loan(Loan&&) = delete;
    ReadPool& pool;
    std::unique_ptr<SqliteDatabase> database;
  };

  std::mutex mutex_;
  std::condition_variable returned_;
  std::vector<std::unique_ptr<SqliteDatabase>> idle_;
};

/// The readers are closed before the writer, which checkpoints.
class JobsFile final : public GroupCommit {
 public:
  JobsFile(std::unique_ptr<SqliteDatabase> writer, queue::DiskHealth& health, const std::string& path, int readers)
      : GroupCommit(std::move(writer), health), readers_(path, readers) {}

 private:
  void run_read(const Run& work) override { readers_.run(work); }

  ReadPool readers_;
};

/// In the order of dependence: the lock is released last.
struct Connections {
  Connections(const std::string& directory, const SqliteSettings& settings);

  files::DirectoryLock lock;
  queue::DiskHealth own_health;
  queue::DiskHealth& health;
  JobsFile jobs;
  GroupCommit deliveries;
};

}  // namespace storage::sqlite
