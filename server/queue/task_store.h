#pragma once
/// The store of tasks: parts of the image of a running job (tracer/parts.h) that any node may trace.
///
/// The node that runs the job publishes its tasks. It and other nodes claim them, each under a lease, and store their
/// results. A task whose lease has ended can be claimed again; a result of an older attempt is refused. The key of a
/// task is a hash of the program, the document and the part, so that results which a dead node left behind are valid
/// for the next attempt of the job. Tasks are deleted when the job ends.
///
/// Unlike jobs, tasks may be lost with the database server: the job then traces them again.

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/queue/job_store.h"

namespace queue {

struct NewTask {
  std::string key;   ///< 64 hex digits
  std::string part;  ///< tracer::Part::bytes
};

struct TaskClaim {
  std::string job_id, key;
  std::int64_t attempt = 0;  ///< grows with every claim of the task
  std::string part;
};

struct TaskOutcome {
  std::string node;          ///< that traced it
  std::int64_t attempt = 1;  ///< number of claims
  std::string result;        ///< bytes of tracer::trace_part
};

/// One node's view of the tasks, in a database that nodes share: see the schema of server/storage/postgres.
/// Thread-safe. Every call may throw StoreFailure.
class TaskStore {
 public:
  /// `node` names this node uniquely, `build` its program. `transactions` must outlive it.
  TaskStore(sql::Transactions& transactions, std::string node, std::string build)
      : transactions_(transactions), node_(std::move(node)), build_(std::move(build)) {}

  /// Adds tasks of a job that runs on this node. Tasks that exist keep their results.
  void publish(const std::string& job_id, const std::vector<NewTask>& tasks);
  /// Claims the first task of a job that runs on this node.
  std::optional<TaskClaim> claim_own(const std::string& job_id);
  /// Claims the last task of a job that runs on another node with the same program. `excluded`: ids of jobs, separated
  /// by spaces.
  std::optional<TaskClaim> claim_other(const std::string& excluded);
  void renew();  ///< the leases of all claims of this node
  /// False if the claim is not the latest, or the job has ended.
  bool finish(const TaskClaim& claim, const std::string& result);
  void release(const TaskClaim& claim);  ///< others may claim the task at once
  /// Keys of the tasks with results.
  std::vector<std::string> finished(const std::string& job_id);
  std::optional<TaskOutcome> outcome(const std::string& job_id, const std::string& key);
  void register_helper();  ///< this node has nothing else to do for some seconds
  int helpers();           ///< number of other nodes with the same program that offered help some seconds ago

 private:
  template <class Work>
  auto write(const Work& work);
  template <class... Values>
  std::optional<TaskClaim> claim(const std::string& condition, const std::string& order, const Values&... values);

  sql::Transactions& transactions_;
  const std::string node_, build_;
};

}  // namespace queue
