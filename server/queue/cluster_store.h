#pragma once
/// State that the nodes of one database share beside the jobs: events in one order, results of running jobs that other
/// nodes have requested, and the nodes themselves.

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/queue/events.h"
#include "server/queue/job_store.h"

namespace queue {

/// A running daemon. Times are milliseconds since 1970 UTC of the database.
struct Node {
  std::string id;    ///< that of its run, as JobMove::worker
  std::string name;  ///< its machine's
  std::string role;  ///< all, api or worker
  std::string version;
  int slots = 0, running = 0;  ///< jobs that may run at once, and that do
  std::int64_t started_at = 0, seen_at = 0;
};

inline constexpr const char* measurement_result = "measurement";

/// In a database that nodes share: see the schema of server/storage/postgres. Thread-safe. Fails with StoreFailure.
class ClusterStore {
 public:
  /// `transactions` must outlive it.
  explicit ClusterStore(sql::Transactions& transactions) : transactions_(transactions) { synchronize(); }

  // ---- events. Every committed change of a job has one; it has a number from number_events() on. The numbers are
  // without gaps, and a reader that has read up to a number misses none before it.

  /// Numbers the events of all changes that were committed before the call; how many there were. None, and nothing is
  /// numbered, while another caller numbers some.
  std::optional<int> number_events();
  struct EventRange {
    std::int64_t first = 1, last = 0;  ///< inclusive; `last` is that of the latest event ever
  };
  EventRange event_range();
  /// At most `limit` events after the number `after`, oldest first. Some thousands are kept.
  std::vector<JobEvent> events_after(std::int64_t after, int limit);

  // ---- results of running jobs: previews and measurements. Kept for minutes, and not over a crash of the database.
  void put_result(const std::string& job_id, const std::string& name, const std::string& bytes);
  std::optional<std::string> find_result(const std::string& job_id, const std::string& name);

  // ---- nodes
  /// Work of a node that it must find even if a message about it was lost.
  struct Duties {
    bool suspects_wait = false;          ///< a suspect (Job) may be claimed
    std::vector<std::string> cancelled;  ///< jobs of this node whose cancel was requested
    int nodes = 0;                       ///< number of nodes that were seen in the last 10 s
  };
  /// Adds or updates a node, seen now. Nodes that were not seen for an hour are removed.
  Duties report_node(const Node& node);
  void remove_node(const std::string& id);
  std::vector<Node> nodes();  ///< by name

  /// The database's clock, on which nodes agree: read at the start and by report_node, continued by the steady clock of
  /// this machine.
  [[nodiscard]] std::int64_t now() const;

 private:
  void synchronize();

  sql::Transactions& transactions_;
  std::atomic<std::int64_t> ahead_us_{0};  ///< the database's clock, compared with the steady clock
};

}  // namespace queue
