#pragma once
/// Parts of a render as tasks, which this worker and those of other nodes trace.
///
/// A round begins here alone. Its first parts measure the pace, and the rest becomes tasks when other nodes have
/// nothing to do and the time that is left exceeds what it takes them to compile the scene and to transfer the parts.
/// From then on every part is claimed through the daemon, so that none is traced twice. Parts that stay without a
/// result for several leases are traced here in any case.

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "server/worker/protocol/protocol.h"
#include "tracer/control.h"
#include "tracer/parts.h"

namespace worker {

struct TaskExchangeSettings {
  std::string job_id;
  std::string document_hash;  ///< with the program: what the keys of tasks stand for
  int threads = 1;            ///< in this process, for parts
  double build_ms = 0;        ///< time to compile the scene, which each other node needs too
  bool resumes = false;       ///< results of an earlier attempt are stored
};

/// Thread-safe.
class TaskExchange final : public tracer::PartExchange {
 public:
  /// `helpers`: number of other nodes that have nothing to do. `send` sends to the daemon. `control` is that of the
  /// render. They must outlive it.
  TaskExchange(TaskExchangeSettings settings, const std::atomic<std::int64_t>& helpers,
               const tracer::RenderControl& control, std::function<void(Message)> send);

  void on_taken(const TaskTaken& message);
  void on_done(TaskDone&& message);

  [[nodiscard]] api::Division division() const;

  bool divides(std::uint64_t samples) override;
  void begin(std::span<const tracer::Part> parts) override;
  std::optional<std::size_t> take() override;
  void put(std::size_t part, std::string_view result) override;
  std::vector<tracer::PartResult> wait() override;

 private:
  using Clock = std::chrono::steady_clock;

  [[nodiscard]] double remaining_ms() const;
  [[nodiscard]] bool should_publish() const;
  void publish();
  void request_task();
  std::optional<std::size_t> overdue_part();

  const TaskExchangeSettings settings_;
  const std::atomic<std::int64_t>& helpers_;
  const tracer::RenderControl& control_;
  const std::function<void(Message)> send_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::span<const tracer::Part> parts_;
  std::size_t next_ = 0;           ///< first part that nobody traces, before the rest is published
  std::vector<std::string> keys_;  ///< by part; empty: it is no task
  std::map<std::string, std::size_t> part_of_key_;
  std::deque<std::size_t> taken_;            ///< parts claimed for this worker, not started
  int waiting_ = 0, requested_ = 0;          ///< threads in take() for an answer of the daemon, and answers on the way
  bool none_left_ = false;                   ///< since the last answer
  std::vector<bool> done_;                   ///< by part: it was traced here or its result is here
  Clock::time_point progress_at_;            ///< when a part was done or taken
  std::vector<tracer::PartResult> results_;  ///< results of others, not read
  std::map<std::size_t, Clock::time_point> started_;
  /// Measured here: thread time, samples, and bytes of results.
  struct {
    double ms = 0, samples = 0, bytes = 0;
  } traced_;
  struct {
    api::Division division{};  ///< its `workers` is that of `nodes`
    double bytes = 0;
    std::set<std::string> nodes;
    bool any = false;
  } published_;
};

}  // namespace worker
