#include "server/storage/sqlite/connections.h"

#include <algorithm>
#include <utility>

#include "server/queue/job_store.h"

namespace storage::sqlite {
namespace {

bool is_broken(const std::exception_ptr& failure) {
  try {
    if (failure) std::rethrow_exception(failure);
  } catch (const queue::StoreFailure& thrown) {
    return thrown.kind == queue::StoreFailure::Kind::broken;
  } catch (...) {
    return false;
  }
  return false;
}

}  // namespace

// ---- GroupCommit

void GroupCommit::wait_for(Operation& operation) {
  std::unique_lock lock(mutex_);
  waiting_.push_back(&operation);
  operation.turn.wait(lock, [&] { return operation.done || !led_; });
  if (!operation.done) lead(lock);
  if (operation.failure) std::rethrow_exception(operation.failure);
}

/// Commits all waiting operations, the caller's among them, and leaves later ones to the first of their threads.
void GroupCommit::lead(std::unique_lock<std::mutex>& lock) {
  led_ = true;
  const std::vector<Operation*> group = std::exchange(waiting_, {});
  lock.unlock();
  commit(group);
  lock.lock();
  led_ = false;
  for (Operation* operation : group) {
    operation->done = true;
    operation->turn.notify_one();  // under the lock: the operation is destroyed as soon as its caller returns
  }
  if (!waiting_.empty()) waiting_.front()->turn.notify_one();
}

void GroupCommit::commit(const std::vector<Operation*>& group) noexcept {
  bool alive = true;
  try {
    health_.check();  // again: the last group may have failed meanwhile
    database_->sync_commits(
        std::ranges::any_of(group, [](const Operation* operation) { return operation->synced == sql::Synced::now; }));
    database_->change("BEGIN IMMEDIATE");
    for (Operation* operation : group) {
      operation->failure = nullptr;
      if (group.size() == 1) {
        operation->work(*database_);  // an exception undoes the transaction, and so its own writes alone
      } else {
        alive = run_in_savepoint(*operation);
      }
      if (!alive) break;
    }
    if (alive) database_->change("COMMIT");
  } catch (...) {
    alive = false;
    for (Operation* operation : group) operation->failure = std::current_exception();
  }
  if (alive) return;
  const auto broken =
      std::ranges::find_if(group, [](const Operation* operation) { return is_broken(operation->failure); });
  if (broken != group.end()) {
    for (Operation* operation : group) operation->failure = (*broken)->failure;
    database_->keep_log();
    return;  // the next start begins with the last committed state
  }
  undo();
  // One that did not fit (a large document on a full disk) must not fail the others.
  if (group.size() == 1) return;
  for (Operation* operation : group) commit({operation});
}

/// False when the whole transaction is undone: SQLite does so on some failures of the disk, the caller on a broken one.
bool GroupCommit::run_in_savepoint(Operation& operation) {
  database_->change("SAVEPOINT operation");
  try {
    operation.work(*database_);
  } catch (...) {
    operation.failure = std::current_exception();
    if (!database_->in_transaction() || is_broken(operation.failure)) return false;
    database_->change("ROLLBACK TO operation");
  }
  database_->change("RELEASE operation");
  return true;
}

void GroupCommit::undo() noexcept {
  try {
    if (database_->in_transaction()) database_->script("ROLLBACK");
    // On a full disk, writes can reuse the log from its start after a checkpoint.
    database_->script("PRAGMA wal_checkpoint(PASSIVE)");
  } catch (...) {
    // A failing disk: the next BEGIN or COMMIT throws.
  }
}

}  // namespace storage::sqlite
