#include "server/queue/job_waiters.h"

#include <algorithm>
#include <utility>

namespace queue {

std::uint64_t JobWaiters::when_ended(const std::string& id, std::function<void()> done) {
  std::uint64_t token = 0;
  {
    const std::lock_guard lock(mutex_);
    token = ++last_token_;
    waiters_.emplace(token, Waiter{id, std::move(done)});
    tokens_.emplace(id, token);
  }
  // Read after the waiter is in place: an end in between calls it exactly once.
  try {
    const std::optional<Job> job = jobs_.find(id);
    if (!job || ended(job->state)) on_ended(id);
  } catch (...) {
    cancel(token);
    throw;
  }
  return token;
}

void JobWaiters::cancel(std::uint64_t token) {
  const std::lock_guard lock(mutex_);
  const auto waiter = waiters_.find(token);
  if (waiter == waiters_.end()) return;
  const auto [first, last] = tokens_.equal_range(waiter->second.id);
  tokens_.erase(std::find_if(first, last, [&](const auto& entry) { return entry.second == token; }));
  waiters_.erase(waiter);
}

std::uint64_t JobWaiters::request_preview(const std::string& id, std::uint32_t side, std::function<void()> done) {
  const Previews::Request request = previews_.request(id, side, std::move(done));
  if (request.is_new) runner_.call([&](JobRunner& runner) { runner.request_preview(id, side); });
  return request.token;
}

void JobWaiters::add_preview(const std::string& id, std::uint32_t side, std::string png) {
  for (const auto& call : previews_.add(id, side, std::move(png))) call();
}

void JobWaiters::on_stopped(const std::string& id) {
  for (const auto& call : previews_.end(id)) call();
}

void JobWaiters::on_ended(const std::string& id) {
  std::vector<std::function<void()>> calls;
  {
    const std::lock_guard lock(mutex_);
    const auto [first, last] = tokens_.equal_range(id);
    for (auto entry = first; entry != last; ++entry) {
      calls.push_back(std::move(waiters_.extract(entry->second).mapped().done));
    }
    tokens_.erase(first, last);
  }
  for (const auto& call : calls) call();
  on_stopped(id);
}

}  // namespace queue
