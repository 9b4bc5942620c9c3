#pragma once
/// Publishes changes of jobs to listeners: filled by the queue, read by event streams and long polls.
///
///   queue::Events events(write, queue::system_clock(), {}, describe);
///   queue.notifications.observe(&events);
///   auto listener = events.listen(job_id, {});   // from now on; null: there are too many listeners
///   listener->on_news(wake);
///   ... when woken: listener->take(8192).text ...
///
/// Each listener has a bounded queue. A listener that does not take its events in time is ended (`over`) without an
/// effect on others; its client listens again after the last number it received. Thread-safe.

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>

#include "server/queue/clock.h"
#include "server/queue/job_observer.h"

namespace queue {

struct JobEvent {
  enum class Kind { state, progress, done };
  std::int64_t number = 0;  ///< grows, also over restarts: it begins with the clock, or continues that of the store
  Kind kind = Kind::state;
  JobSummary job;
  std::string state;  ///< a JobState's name, or "removed"
  double progress = 0;
  std::int64_t at = 0;  ///< milliseconds since 1970 UTC
};

struct EventSettings {
  std::size_t listeners_max = 5000;
  /// State events that are kept for clients that reconnect: some seconds of the busiest queue, about 1 MiB.
  std::size_t kept = 4096;
  /// Untaken events of one listener. A reader this far behind a busy queue does not catch up.
  std::size_t untaken_max = 512;
  /// Minimum time between two progress events of a job.
  std::chrono::milliseconds progress_interval{200};
};

class Events final : public JobObserver {
 public:
  /// `write` serializes an event when the first listener takes it; called at most once for each, from any thread.
  using Writer = std::function<std::string(const JobEvent&)>;
  /// Reads a job from the store, for its events, where on_described did not describe it lately. Called from any thread;
  /// may throw StoreFailure, and the events then have its id only.
  using Describe = std::function<std::optional<JobSummary>(const std::string& id)>;
  Events(Writer write, Clock clock, EventSettings settings = {}, Describe describe = {});

  void on_described(const JobSummary& job) noexcept override;
  void on_state_changed(const std::string& id, JobState to) noexcept override;
  void on_progress(const std::string& id, double fraction) noexcept override;
  void on_removed(const JobSummary& job) noexcept override;

  // ---- where several nodes have one order of events: ClusterStore has their numbers
  /// The events after `number` follow by `add`; the earlier ones are not kept. From now on progress has the number of
  /// the event before it. `catch_up` adds all events that exist; it is called, with no lock held, by a listener that
  /// has received an event of another node which is not here yet. Listeners are ended.
  void continue_from(std::int64_t number, std::function<void()> catch_up);
  void add(JobEvent event) noexcept;

  struct Batch {
    std::string text;   ///< complete events
    bool over = false;  ///< no event follows: the last event of the job was taken, or the listener was too slow
  };
  class Listener;

  /// The events of one job or of the jobs of one batch, whose id is `topic`; or where it is empty, of all jobs with
  /// JobSummary::keep. Those after the number `after`, else those from now on. Null with `listeners_max` listeners.
  /// Must not outlive this.
  std::unique_ptr<Listener> listen(const std::string& topic, std::optional<std::int64_t> after);

  /// True if the last event of the job is kept and has this number or a smaller one.
  [[nodiscard]] bool ended_by(const std::string& job_id, std::int64_t number) const;

  [[nodiscard]] std::int64_t latest() const;  ///< the number of the latest event
  [[nodiscard]] std::size_t listeners() const;
  [[nodiscard]] std::size_t listeners_max() const { return settings_.listeners_max; }

 private:
  struct Written {
    JobEvent event;
    std::string text = {};  ///< empty until a listener takes it
  };
  using SharedEvent = std::shared_ptr<Written>;

  JobSummary describe(const std::string& id, JobEvent::Kind kind);
  void cache(const JobSummary& job);
  void publish(JobEvent event) noexcept;
  void deliver(JobEvent event) noexcept;
  const std::string& text_of(Written& event) const;
  [[nodiscard]] bool has_listener(const std::string& topic) const;
  void remove(Listener& listener);

  const Writer write_;
  const Clock clock_;
  const EventSettings settings_;
  const Describe describe_;

  mutable std::mutex mutex_;
  std::int64_t last_;       ///< number of the latest event
  std::int64_t floor_;      ///< all state events after this number are kept
  bool is_shared_ = false;  ///< since continue_from
  std::function<void()> catch_up_;
  std::deque<SharedEvent> kept_;                           ///< oldest first
  std::set<std::pair<std::string, Listener*>> listeners_;  ///< by topic
  struct CachedJob {
    JobSummary job;
    std::int64_t progress_at = 0;  ///< time of the latest progress event
  };
  std::unordered_map<std::string, CachedJob> cached_;  ///< some jobs that have not ended, so that few are read again
};

class Events::Listener {
 public:
  Listener(Events& events, std::string topic, std::int64_t start, bool missed)
      : events_(events),
        topic_(std::move(topic)),
        start_(start),
        missed_(missed),
        untaken_max_(events.settings_.untaken_max) {}
  ~Listener() { events_.remove(*this); }
  Listener(Listener&&) = delete;

  /// `wake` is called when the queue is no longer empty, at once if it is not now. Must be quick and not throw.
  void on_news(std::function<void()> wake);
  /// The oldest untaken events: at least one if there is one, then as many as fit into `bytes`.
  Batch take(std::size_t bytes);
  /// The number of the last event before those of this listener.
  [[nodiscard]] std::int64_t start() const { return start_; }
  /// True if events after the requested number are not kept any more: the client must read the jobs.
  [[nodiscard]] bool missed() const { return missed_; }

 private:
  friend class Events;
  [[nodiscard]] bool is_for(const JobSummary& job) const {
    return topic_.empty() ? job.keep : topic_ == job.id || topic_ == job.batch;
  }
  void push(const SharedEvent& event);

  // Guarded by Events::mutex_.
  Events& events_;
  const std::string topic_;
  const std::int64_t start_;
  const bool missed_;
  std::size_t untaken_max_;
  std::function<void()> wake_;
  std::deque<SharedEvent> untaken_;
  bool over_ = false;
};

}  // namespace queue
