#include "server/worker/supervisor/job_slots.h"

#include <algorithm>
#include <set>

namespace worker {

std::size_t JobSlots::count_large() const {
  return static_cast<std::size_t>(
      std::count_if(running.begin(), running.end(), [](const auto& entry) { return entry.second.large; }));
}

bool JobSlots::has_slot_for_large(std::size_t claims) const {
  return settings_.slots == 1 || count_large() + claims < static_cast<std::size_t>(settings_.slots) - 1;
}

bool JobSlots::is_busy(const std::string& owner) const {
  return std::count_if(running.begin(), running.end(),
                       [&](const auto& entry) { return entry.second.owner == owner; }) >= settings_.owner_slots;
}

std::vector<std::string> JobSlots::busy_owners() const {
  if (settings_.owner_slots >= settings_.slots) return {};
  std::set<std::string> busy;
  for (const auto& [id, job] : running)
    if (is_busy(job.owner)) busy.insert(job.owner);
  return {busy.begin(), busy.end()};
}

std::pair<const std::string, RunningJob>* JobSlots::surplus_large_job() {
  if (settings_.slots == 1 || count_large() < static_cast<std::size_t>(settings_.slots)) return nullptr;
  std::pair<const std::string, RunningJob>* last = nullptr;
  for (auto& entry : running) {
    const RunningJob& job = entry.second;
    if (job.is_stopping()) return nullptr;
    if (job.large_since && (last == nullptr || *job.large_since > *last->second.large_since)) last = &entry;
  }
  return last;
}

}  // namespace worker
