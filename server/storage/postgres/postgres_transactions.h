#pragma once
/// The connections of one node to PostgreSQL. Private to this directory.

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/storage/postgres/postgres_database.h"

namespace storage::postgres {

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
  std::unique_ptr<PostgresDatabase> take();
  void release(std::unique_ptr<PostgresDatabase> database);

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
  void run_write(const Run& work, sql::Synced synced) override;
  void run_read(const Run& work) override;
  bool try_write(const Run& work, sql::Synced synced, bool is_last);
  bool has_committed(const std::string& transaction_id, const std::string& server_run);
  void add_up_counts();

  ConnectionPool pool_;
  std::atomic<unsigned> writes_{0};
};

}  // namespace storage::postgres
