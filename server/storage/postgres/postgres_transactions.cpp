#include "server/storage/postgres/postgres_transactions.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "server/queue/job_store.h"
#include "server/storage/postgres/postgres_database.h"

namespace storage::postgres {
namespace {

/// Conflicts end with one of the transactions committed, so a few attempts are enough for all of them.
constexpr int attempts_max = 10;
constexpr std::chrono::milliseconds pause_after_failure(300);
/// Time to find the outcome of a commit whose answer was lost: a restart of the server, or a switch to its replica.
constexpr std::chrono::seconds patience(10);
/// Counts are added up after every so many writes, so that reading them costs little.
constexpr unsigned writes_until_add_up = 64;

[[noreturn]] void fail_unknown() {
  throw queue::StoreFailure(queue::StoreFailure::Kind::unknown, "PostgreSQL: the connection was lost at a commit");
}

/// Connections that are opened when they are needed, each used by one caller at a time. A lost one is replaced.
class ConnectionPool {
 public:
  ConnectionPool(std::string dsn, int connections_max) : dsn_(std::move(dsn)), free_(connections_max) {}

  class PooledConnection {
   public:
    explicit PooledConnection(ConnectionPool& pool) : pool_(pool), database_(pool.take()) {}
    ~PooledConnection() { pool_.release(std::move(database_)); }
    PooledConnection(PooledConnection&&) = delete;
    PostgresDatabase& operator*() const { return *database_; }
    PostgresDatabase* operator->() const { return database_.get(); }

   private:
    ConnectionPool& pool_;
    std::unique_ptr<PostgresDatabase> database_;
  };

 private:
  std::unique_ptr<PostgresDatabase> take() {
    std::unique_lock lock(mutex_);
    returned_.wait(lock, [&] { return free_ > 0; });
    --free_;
    if (!idle_.empty()) {
      auto database = std::move(idle_.back());
      idle_.pop_back();
      return database;
    }
    try {
      if (last_failure_ && std::chrono::steady_clock::now() < next_attempt_) std::rethrow_exception(last_failure_);
      lock.unlock();
      auto database = std::make_unique<PostgresDatabase>(dsn_);
      lock.lock();
      last_failure_ = nullptr;
      return database;
    } catch (...) {
      if (!lock.owns_lock()) {
        lock.lock();
        last_failure_ = std::current_exception();
        next_attempt_ = std::chrono::steady_clock::now() + pause_after_failure;
      }
      ++free_;
      returned_.notify_one();
      throw;
    }
  }

  void release(std::unique_ptr<PostgresDatabase> database) {
    const std::lock_guard lock(mutex_);
    if (database->is_broken()) {
      idle_.clear();  // the others of a server that has ended are lost too
    } else {
      idle_.push_back(std::move(database));
    }
    ++free_;
    returned_.notify_one();
  }

  const std::string dsn_;
  std::mutex mutex_;
  std::condition_variable returned_;
  std::vector<std::unique_ptr<PostgresDatabase>> idle_;
  int free_;  ///< connections that may be lent
  /// While the server cannot be reached, callers fail at once and not after the time limit of a connection.
  std::chrono::steady_clock::time_point next_attempt_;
  std::exception_ptr last_failure_;
};

class PostgresTransactions final : public sql::Transactions {
 public:
  PostgresTransactions(std::string dsn, int connections) : pool_(std::move(dsn), connections) {}

 private:
  void run_write(const Run& work, sql::Synced synced) override {
    int attempts = 1;
    while (!try_write(work, synced, attempts == attempts_max)) ++attempts;
    if (++writes_ % writes_until_add_up == 0) add_up_counts();
  }

  /// False if it may be tried again: nothing was changed.
  bool try_write(const Run& work, sql::Synced synced, bool is_last) {
    std::string transaction_id, server_run;
    bool committing = false;
    try {
      const ConnectionPool::PooledConnection database(pool_);
      try {
        const bool is_synced = synced == sql::Synced::now;
        server_run = database->server_run();
        database->begin_write(is_synced, is_synced);
        work(*database);
        if (is_synced) transaction_id = database->transaction_id();
        committing = true;
        database->commit();
        return true;
      } catch (...) {
        const bool is_lost = database->is_broken();
        database->roll_back();
        committing = committing && is_lost;
        // A connection that was lost while it was idle is seen at its next use.
        if (is_lost && !committing && !is_last) return false;
        throw;
      }
    } catch (const Conflict&) {
      if (!is_last) return false;
      throw queue::StoreFailure("PostgreSQL: conflicts with other transactions");
    } catch (const queue::StoreFailure&) {
      if (!committing) throw;
      if (synced == sql::Synced::with_next) throw;  // claims and leases, which end in time
      return has_committed(transaction_id, server_run);
    }
  }

  /// The outcome of a transaction whose COMMIT had no answer. Throws StoreFailure where it is unknown: another
  /// transaction that has committed may have got its id after a crash of the server.
  bool has_committed(const std::string& transaction_id, const std::string& server_run) {
    const auto end = std::chrono::steady_clock::now() + patience;
    const auto outcome = [id = "'" + transaction_id + "'"](bool crashed) {
      const std::string lost = crashed ? "pg_snapshot_xmax(pg_current_snapshot()) <= " + id + "::xid8" : "false";
      return "SELECT CASE WHEN " + lost + " THEN 'aborted' ELSE pg_xact_status(" + id + ") END";
    };
    while (!transaction_id.empty() && std::chrono::steady_clock::now() < end) {
      try {
        const ConnectionPool::PooledConnection database(pool_);
        const bool crashed = database->server_run() != server_run;
        const std::string status = database->value(outcome(crashed));
        if (status == "committed" && crashed) break;
        if (status == "committed") return true;
        if (status == "aborted") return false;
      } catch (const queue::StoreFailure&) {
        // Not reachable yet.
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    fail_unknown();
  }

  void run_read(const Run& work) override {
    for (int attempt = 1;; ++attempt) {
      const ConnectionPool::PooledConnection database(pool_);
      try {
        database->begin_read();
        work(*database);
        database->commit();
        return;
      } catch (...) {
        const bool is_lost = database->is_broken();
        database->roll_back();
        if (!is_lost || attempt > 1) throw;
      }
    }
  }

  void add_up_counts() {
    try {
      try_write([](sql::Database& database) { database.query("SELECT add_up_counts()").row(); }, sql::Synced::with_next,
                true);
    } catch (const queue::StoreFailure&) {
      // The counts are right without it; a later write adds them up.
    }
  }

  ConnectionPool pool_;
  std::atomic<unsigned> writes_{0};
};

}  // namespace

std::unique_ptr<sql::Transactions> make_transactions(const std::string& dsn, int connections) {
  return std::make_unique<PostgresTransactions>(dsn, connections);
}

}  // namespace storage::postgres
