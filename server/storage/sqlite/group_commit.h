#pragma once
/// All writes of the process through one connection and one thread. What waits when the thread is free is committed
/// together: one sync of the disk answers many callers. Private to this folder.

#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <type_traits>
#include <vector>

#include "server/jobs/disk_health.h"
#include "server/storage/sqlite/database.h"

namespace jobs::sqlite {

/// When a change survives power loss. Either way it survives the death of the process once it is answered; WAL keeps
/// the order of commits, so that a synced one brings all before it along.
enum class Synced {
  now,        ///< before it is answered
  with_next,  ///< with the next one that is synced: a power cut may undo it
};

class GroupCommit {
 public:
  /// `health` is that of the disk and must outlive this.
  GroupCommit(std::unique_ptr<Database> database, DiskHealth& health);
  ~GroupCommit();  ///< no call may be in progress

  /// Runs `work(database)` inside a transaction and returns its value once that is committed, and synced as asked. What
  /// `work` throws undoes its own writes alone and is thrown here. `work` may run a second time, after everything it
  /// did was undone.
  template <class Work>
  auto run(Work work, Synced synced = Synced::now) {
    std::optional<std::invoke_result_t<Work, Database&>> result;
    Operation operation{[&](Database& database) { result = work(database); }, synced, nullptr, false, {}};
    health_.run([&] { wait_for(operation); });
    return *std::move(result);
  }

 private:
  struct Operation {
    std::function<void(Database&)> work;
    Synced synced = Synced::now;
    std::exception_ptr failure;
    bool answered = false;
    std::condition_variable answer;
  };

  void wait_for(Operation& operation);
  void run_groups();
  void commit(const std::vector<Operation*>& group);
  bool run_in_savepoint(Operation& operation);
  void undo() noexcept;

  std::unique_ptr<Database> database_;
  DiskHealth& health_;
  std::mutex mutex_;
  std::condition_variable work_waits_;
  std::vector<Operation*> waiting_;
  bool stopping_ = false;
  std::thread thread_;  ///< last: starts when the rest is there
};

}  // namespace jobs::sqlite
