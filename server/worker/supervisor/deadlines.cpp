#include "server/worker/supervisor/deadlines.h"

#include <algorithm>

namespace worker {

void Deadlines::add(const queue::Job& job, Time now) {
  JobTimes& times = jobs_[job.id] = {};
  const std::string limit_s = std::to_string(std::chrono::duration<double>(settings_.wall_time).count());
  times.stop_at = now + settings_.wall_time;
  times.overdue = {"timed_out", "An attempt took longer than the limit wall_time_s of " + limit_s + " s.", {}};
  if (!job.large && settings_.slots > 1) times.slow_at = now + settings_.small_job_time;
  if (!job.deadline) return;
  const auto until_deadline = std::chrono::milliseconds(*job.deadline - *job.started_at);
  if (until_deadline >= settings_.wall_time) return;
  times.stop_at = now + until_deadline;
  times.overdue = queue::deadline_exceeded();
}

std::vector<Deadlines::Overdue> Deadlines::take_overdue(Time now) {
  std::vector<Overdue> overdue;
  for (auto& [id, times] : jobs_) {
    if (!times.stop_at || now < *times.stop_at) continue;
    times.stop_at.reset();
    overdue.push_back({id, times.overdue});
  }
  return overdue;
}

std::vector<std::string> Deadlines::take_slow(Time now) {
  std::vector<std::string> ids;
  for (auto& [id, times] : jobs_) {
    if (!times.slow_at || now < *times.slow_at) continue;
    times.slow_at.reset();
    ids.push_back(id);
  }
  return ids;
}

bool Deadlines::stop(const std::string& id, Time now) {
  JobTimes& times = jobs_[id];
  times.report_at = now + settings_.cancel_answer;
  if (times.kill_at) return false;
  times.kill_at = now + settings_.cancel_grace;
  return true;
}

std::vector<std::string> Deadlines::take_reportable(Time now) {
  std::vector<std::string> ids;
  for (auto& [id, times] : jobs_) {
    if (!times.report_at || now < *times.report_at) continue;
    times.report_at.reset();
    times.reported = true;
    ids.push_back(id);
  }
  return ids;
}

bool Deadlines::is_reported(const std::string& id) const {
  const auto found = jobs_.find(id);
  return found != jobs_.end() && found->second.reported;
}

bool Deadlines::worker_must_end(Time now) const {
  return std::any_of(jobs_.begin(), jobs_.end(),
                     [now](const auto& entry) { return entry.second.kill_at && now >= *entry.second.kill_at; });
}

void Deadlines::start_drain(Time end) { drain_end_ = end; }

bool Deadlines::take_drain_end(Time now) {
  if (drain_ended_ || !drain_end_ || now < *drain_end_) return false;
  return drain_ended_ = true;
}

Deadlines::Time Deadlines::next(bool worker_ready) const {
  Time next = Time::max();
  const auto consider = [&next](const std::optional<Time>& time) {
    if (time) next = std::min(next, *time);
  };
  if (!drain_ended_) consider(drain_end_);
  for (const auto& [id, times] : jobs_) {
    consider(times.report_at);
    if (!worker_ready) continue;
    consider(times.stop_at);
    consider(times.slow_at);
    consider(times.kill_at);
  }
  return next;
}

}  // namespace worker
