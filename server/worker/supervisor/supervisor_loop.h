#pragma once
/// The event loop of the supervisor: one thread that owns the worker process, its jobs and their deadlines. It never
/// waits for the store: StoreExecutor calls it and posts the results back.

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "server/worker/supervisor/deadlines.h"
#include "server/worker/supervisor/job_dispatcher.h"
#include "server/worker/supervisor/outcome_writer.h"
#include "server/worker/supervisor/store_executor.h"
#include "server/worker/supervisor/worker_process.h"

namespace worker {

class Supervisor::Loop final : public queue::JobRunner {
 public:
  Loop(queue::Queue& queue, SupervisorSettings settings, const queue::Log& log);
  ~Loop() override;

  void notify(bool for_suspects) noexcept override;
  void cancel(const std::string& id) noexcept override;
  void request_preview(const std::string& id, std::uint32_t side) noexcept override;
  void on_lease_lost(const queue::Lease& lease) noexcept override;
  bool take_slot() noexcept override { return dispatcher_.take_slot(); }
  void return_slot(std::optional<queue::Claim> claim) noexcept override { dispatcher_.return_slot(std::move(claim)); }
  std::string not_ready() override;

  bool drain(std::chrono::milliseconds timeout);
  [[nodiscard]] const WorkerProcess& process() const { return process_; }
  [[nodiscard]] const JobDispatcher& dispatcher() const { return dispatcher_; }

 private:
  void run();
  void read_messages();
  void handle_worker_exit();
  [[nodiscard]] Deadlines::Time next_deadline() const;

  const SupervisorSettings settings_;
  LoopEvents events_;
  std::unique_ptr<StoreExecutor> store_executor_;
  WorkerProcess process_;
  Deadlines deadlines_;
  OutcomeWriter outcomes_;
  JobDispatcher dispatcher_;
  std::atomic<bool> draining_ = false;
  bool interrupted_by_drain_ = false;
  std::mutex drain_mutex_;
  std::thread thread_;  ///< last: starts after the other members
};

}  // namespace worker
