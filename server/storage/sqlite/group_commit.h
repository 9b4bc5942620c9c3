#pragma once
/// All writes of the process through one connection (group commit). A caller that finds the connection idle commits at
/// once on its own thread: a hand-over costs more than most commits. Operations that arrive meanwhile wait, and one of
/// their threads commits all of them with one sync. Private to this directory.

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

namespace storage::sqlite {

/// When a change survives power loss. It survives the death of the process in any case; WAL keeps the order of commits,
/// so a synced one makes all before it durable.
enum class Synced {
  now,        ///< before the call returns
  with_next,  ///< with the next synced one: power loss may undo it
};

inline Synced synced(bool durable) { return durable ? Synced::now : Synced::with_next; }

class GroupCommit {
 public:
  /// `health` must outlive this. No call may be in progress at the destruction.
  GroupCommit(std::unique_ptr<Database> database, queue::DiskHealth& health)
      : database_(std::move(database)), health_(health) {}

  /// Runs `work(database)` inside a transaction and returns its value once that is committed and synced as requested.
  /// An exception of `work` undoes its own writes alone and is thrown here. `work` may run a second time, after its
  /// writes were undone.
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
    bool done = false;
    std::condition_variable turn;  ///< it is done, or may lead
  };

  void wait_for(Operation& operation);
  void lead(std::unique_lock<std::mutex>& lock);
  void commit(const std::vector<Operation*>& group) noexcept;
  bool run_in_savepoint(Operation& operation);
  void undo() noexcept;

  std::unique_ptr<Database> database_;  ///< used by the committing thread
  queue::DiskHealth& health_;
  std::mutex mutex_;
  std::vector<Operation*> waiting_;
  bool led_ = false;  ///< a thread is committing
};

}  // namespace storage::sqlite
