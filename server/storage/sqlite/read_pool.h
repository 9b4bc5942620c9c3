#pragma once
/// A few read-only connections, each used by one caller at a time. Private to this directory.

#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/storage/sqlite/database.h"

namespace storage::sqlite {

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

}  // namespace storage::sqlite
