#pragma once
/// What happens to jobs, told to whoever listens while it happens: filled by the queue, read by event streams and long
/// polls.
///
///   queue::Events events(write, queue::system_clock());
///   queue.observe(&events);
///   auto listener = events.listen(job_id, {});   // from now on; null: too many listen
///   listener->on_news(wake);
///   ... when woken: listener->take(8192).text ...
///
/// A listener has a short queue of its own. One that does not take what is in it loses its place (`over`): that costs
/// nobody but itself, and it goes on after the last number it saw. Thread-safe, all of it.

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>

#include "server/queue/clock.h"
#include "server/queue/job_observer.h"

namespace queue {

struct JobEvent {
  enum class Kind { state, progress, done };
  std::int64_t number = 0;  ///< grows; also over restarts, for it begins with the clock
  Kind kind = Kind::state;
  std::string job_id;
  std::string state;  ///< a JobState's name, or "removed"
  double progress = 0;
  std::int64_t at = 0;  ///< milliseconds since 1970 UTC
};

struct EventSettings {
  std::size_t listeners_max = 5000;
  /// Moves that are kept for those who come back: some seconds of the busiest queue, about 1 MiB.
  std::size_t kept = 4096;
  /// Untaken events of one listener. A reader this far behind a busy queue does not catch up.
  std::size_t untaken_max = 512;
  /// Progress of one job is told at most this often: smooth to the eye.
  std::chrono::milliseconds progress_interval{200};
};

class Events final : public JobObserver {
 public:
  /// `write` gives an event the text in which listeners take it; called once for each, so it may be long. Any thread.
  using Writer = std::function<std::string(const JobEvent&)>;
  Events(Writer write, Clock clock, EventSettings settings = {});
  ~Events() override;

  void on_state_changed(const std::string& id, JobState to) noexcept override;
  void on_progress(const std::string& id, double fraction) noexcept override;
  void on_removed(const std::string& id) noexcept override;

  struct Batch {
    std::string text;   ///< whole events
    bool over = false;  ///< nothing comes after it: the job's last event is in it or was, or the listener was too slow
  };

  class Listener {
   public:
    virtual ~Listener() = default;  ///< listens no more
    /// `wake` is called when there is something after nothing was; at once if there is now. Must be quick and not
    /// throw.
    virtual void on_news(std::function<void()> wake) = 0;
    /// The oldest events not taken yet: at least one if there is one, then as many as fit into `bytes`.
    virtual Batch take(std::size_t bytes) = 0;
    /// The number of the last event before those it will take.
    [[nodiscard]] virtual std::int64_t start() const = 0;
    /// It asked for events after a number that are not all kept any more: it has to look at the jobs itself.
    [[nodiscard]] virtual bool missed() const = 0;
  };

  /// The events of one job, or of all where `job_id` is empty: those after the number `after`, else those from now on.
  /// Null when `listeners_max` listen already. Must not outlive this.
  std::unique_ptr<Listener> listen(const std::string& job_id, std::optional<std::int64_t> after);

  /// Is a job's last event among those kept, at `number` or before?
  [[nodiscard]] bool ended_by(const std::string& job_id, std::int64_t number) const;

  [[nodiscard]] std::int64_t latest() const;  ///< the number of the latest event
  [[nodiscard]] std::size_t listeners() const;
  [[nodiscard]] std::size_t listeners_max() const { return settings_.listeners_max; }

 private:
  class Place;
  struct Told {
    JobEvent event;
    std::string text;
  };

  void tell(JobEvent event) noexcept;
  void forget(Place* place);

  const Writer write_;
  const Clock clock_;
  const EventSettings settings_;

  mutable std::mutex mutex_;
  std::int64_t last_;                              ///< number of the latest event
  std::int64_t floor_;                             ///< all moves after this one are kept
  std::deque<std::shared_ptr<const Told>> moves_;  ///< oldest first
  std::unordered_set<Place*> of_all_;
  std::unordered_multimap<std::string, Place*> of_job_;
  std::unordered_map<std::string, std::int64_t> progress_told_;  ///< when; of jobs that run and are listened to
};

}  // namespace queue
