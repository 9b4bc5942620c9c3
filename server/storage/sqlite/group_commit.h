#pragma once
/// All writes of the process through one connection. Whoever finds nobody writing does so at once, on the own thread:
/// a hand-over there and back costs more than most commits. What comes meanwhile waits and is committed together by one
/// of those who wait: one sync of the disk answers many callers. Private to this directory.

#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include "server/queue/disk_health.h"
#include "server/storage/sqlite/database.h"

namespace queue::sqlite {

/// When a change survives power loss. Either way it survives the death of the process once it is answered; WAL keeps
/// the order of commits, so that a synced one brings all before it along.
enum class Synced {
  now,        ///< before it is answered
  with_next,  ///< with the next one that is synced: a power cut may undo it
};

class GroupCommit {
 public:
  /// `health` is that of the disk and must outlive this.
  /// No call may be in progress when it goes.
  GroupCommit(std::unique_ptr<Database> database, DiskHealth& health)
      : database_(std::move(database)), health_(health) {}

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
    std::condition_variable turn;  ///< it was answered, or may lead
  };

  void wait_for(Operation& operation);
  void lead(std::unique_lock<std::mutex>& lock);
  void commit(const std::vector<Operation*>& group) noexcept;
  bool run_in_savepoint(Operation& operation);
  void undo() noexcept;

  std::unique_ptr<Database> database_;  ///< the leader's
  DiskHealth& health_;
  std::mutex mutex_;
  std::vector<Operation*> waiting_;
  bool led_ = false;  ///< somebody commits
};

}  // namespace queue::sqlite
