#pragma once
/// Connects the queue of this node with those of the other nodes of its database: wakes their runners and waiters, and
/// gives all of them one order of events.
///
///   queue::NodeLink link(queue, events, cluster.store, cluster.wakeups, node, log);
///   queue.notifications.observe(&link);

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/queue/cluster_store.h"
#include "server/queue/event_log.h"
#include "server/queue/events.h"
#include "server/queue/queue.h"
#include "server/queue/wakeups.h"
#include "server/support/locked.h"

namespace queue {

struct NodeLinkSettings {
  Node node;  ///< this daemon; `slots` and `running` are read from `load`
  /// Slots and running jobs, any thread.
  std::function<std::pair<int, int>()> load = [] { return std::pair(0, 0); };
  /// False on nodes without clients: nobody listens to events or waits for jobs.
  bool has_clients = true;
  /// Time within which the node reads the tables although no message has come, and reports itself.
  std::chrono::milliseconds interval{1000};
};

/// Its thread reads and numbers events, reports the node and exchanges previews. Thread-safe.
class NodeLink final : public JobObserver {
 public:
  /// All references must outlive it.
  NodeLink(Queue& queue, Events& events, ClusterStore& store, Wakeups& wakeups, Log log);
  ~NodeLink() override;
  NodeLink(NodeLink&&) = delete;

  void start(NodeLinkSettings settings);  ///< once
  /// Ends the exchange and removes the node. Call it when no job runs here any more.
  void leave() noexcept;

  void on_described(const JobSummary& job) noexcept override { events_.on_described(job); }
  void on_state_changed(const std::string& /*id*/, JobState /*to*/) noexcept override { wake(); }
  void on_progress(const std::string& id, double fraction) noexcept override;
  void on_removed(const JobSummary& /*job*/) noexcept override { wake(); }
  void on_measurement(const std::string& id, const std::string& summary) noexcept override;

 private:
  void stop() noexcept;
  void run();
  void step(bool has_changes, bool has_events, bool is_due);
  bool number_events();
  void subscribe();
  void read_events();
  void on_event(const JobEvent& event);
  void report();
  void send_progress();
  /// Changes what the thread waits for.
  template <class Change>
  void change(const Change& made) noexcept {
    support::locked(mutex_, made);
    changed_.notify_all();
  }
  void post(std::function<void()> task) noexcept {
    change([&] { tasks_.push_back(std::move(task)); });
  }
  void wake() noexcept {
    change([this] { has_changes_ = true; });
  }
  void answer_preview(const std::string& id_and_side);
  void fetch_preview(const std::string& id_and_side);

  Queue& queue_;
  Events& events_;
  ClusterStore& store_;
  Wakeups& wakeups_;
  const Log log_;
  NodeLinkSettings settings_;
  int steps_with_suspects_ = 0;
  std::chrono::milliseconds pause_{1};  ///< between two steps: changes that come meanwhile are numbered together

  std::mutex read_mutex_;      ///< held while events are read and added, in their order
  std::int64_t read_to_ = -1;  ///< number of the latest event that was read; -1: none were

  std::mutex mutex_;
  std::condition_variable changed_;
  bool stopping_ = false, has_changes_ = false, has_events_ = false;
  std::deque<std::function<void()>> tasks_;
  std::map<std::string, double> progress_;  ///< not sent yet, by id of a job that runs here
  std::vector<std::shared_ptr<void>> subscriptions_;
  std::thread thread_;
};

}  // namespace queue
