#include "server/worker/supervisor/job_slots.h"

#include <algorithm>
#include <set>

namespace worker {

void JobSlots::add(const queue::Job& job, std::int64_t fence, Time now) {
  RunningJob& added = running[job.id];
  added.job = job;
  added.fence = fence;
  const std::string limit_s = std::to_string(std::chrono::duration<double>(settings_.wall_time).count());
  added.stop_at = now + settings_.wall_time;
  added.overdue = {"timed_out", "An attempt took longer than the limit wall_time_s of " + limit_s + " s.", {}};
  if (!job.large && settings_.slots > 1) added.slow_at = now + settings_.small_job_time;
  if (!job.deadline) return;
  const auto until_deadline = std::chrono::milliseconds(*job.deadline - *job.started_at);
  if (until_deadline >= settings_.wall_time) return;
  added.stop_at = now + until_deadline;
  added.overdue = queue::deadline_exceeded();
}

Time JobSlots::next_deadline(bool worker_ready) const {
  Time next = Time::max();
  for (const auto& [id, job] : running) {
    next = std::min(next, job.report_at.value_or(next));
    for (const auto& time : {job.stop_at, job.slow_at, job.kill_at})
      if (worker_ready && time) next = std::min(next, *time);
  }
  return next;
}

std::size_t JobSlots::count_large() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(running, [](const auto& entry) { return entry.second.job.large; }));
}

bool JobSlots::has_slot_for_large(std::size_t claims) const {
  return settings_.slots == 1 || count_large() + claims < static_cast<std::size_t>(settings_.slots) - 1;
}

bool JobSlots::is_busy(const std::string& owner) const {
  return std::ranges::count_if(running, [&](const auto& entry) { return entry.second.job.owner == owner; }) >=
         settings_.owner_slots;
}

std::vector<std::string> JobSlots::busy_owners() const {
  if (settings_.owner_slots >= settings_.slots) return {};
  std::set<std::string> busy;
  for (const auto& [id, job] : running)
    if (is_busy(job.job.owner)) busy.insert(job.job.owner);
  return {busy.begin(), busy.end()};
}

RunningJob* JobSlots::surplus_large_job() {
  if (settings_.slots == 1 || count_large() < static_cast<std::size_t>(settings_.slots)) return nullptr;
  RunningJob* last = nullptr;
  for (auto& [id, job] : running) {
    if (job.is_stopping()) return nullptr;
    if (job.large_since && (last == nullptr || *job.large_since > *last->large_since)) last = &job;
  }
  return last;
}

}  // namespace worker
