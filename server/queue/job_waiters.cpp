#include "server/queue/job_waiters.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

namespace queue {
namespace {

constexpr std::uint32_t all_sides = std::numeric_limits<std::uint32_t>::max();

/// All sizes of one job.
template <class Map>
auto of_job(Map& map, const std::string& id) {
  return std::pair(map.lower_bound({id, 0}), map.upper_bound({id, all_sides}));
}

}  // namespace

// ---- Previews

void Previews::begin(const std::string& id) {
  const std::lock_guard lock(mutex_);
  running_.insert(id);
}

Previews::Latest Previews::latest(const std::string& id, std::uint32_t side) const {
  const std::int64_t now = clock_();
  const std::lock_guard lock(mutex_);
  const auto found = entries_.find({id, side});
  if (found == entries_.end()) return {};
  return {found->second.png, now - found->second.at <= fresh_ms};
}

Previews::Request Previews::request(const std::string& id, std::uint32_t side, std::function<void()> done) {
  const std::lock_guard lock(mutex_);
  const Key key{id, side};
  const bool is_new = !waiters_.contains(key);
  waiters_.emplace(key, Waiter{++last_token_, std::move(done)});
  return {last_token_, is_new};
}

void Previews::cancel(std::uint64_t token) {
  const std::lock_guard lock(mutex_);
  const auto found =
      std::find_if(waiters_.begin(), waiters_.end(), [&](const auto& entry) { return entry.second.token == token; });
  if (found != waiters_.end()) waiters_.erase(found);
}

bool Previews::is_running(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  return running_.contains(id);
}

bool Previews::is_requested(const std::string& id, std::uint32_t side) const {
  const std::lock_guard lock(mutex_);
  return waiters_.contains({id, side});
}

Previews::Calls Previews::add(const std::string& id, std::uint32_t side, std::string png) {
  const std::int64_t now = clock_();
  Calls calls;
  const std::lock_guard lock(mutex_);
  const Key key{id, side};
  if (!running_.contains(id) && !waiters_.contains(key)) return calls;
  if (!entries_.contains(key)) evict_oldest(id);
  entries_.insert_or_assign(key, Entry{std::make_shared<const std::string>(std::move(png)), now});
  const auto [first, last] = waiters_.equal_range(key);
  std::for_each(first, last, [&](auto& entry) { calls.push_back(std::move(entry.second.done)); });
  waiters_.erase(first, last);
  return calls;
}

Previews::Calls Previews::end(const std::string& id) {
  Calls calls;
  const std::lock_guard lock(mutex_);
  running_.erase(id);
  const auto [first_entry, last_entry] = of_job(entries_, id);
  entries_.erase(first_entry, last_entry);
  const auto [first, last] = of_job(waiters_, id);
  std::for_each(first, last, [&](auto& entry) { calls.push_back(std::move(entry.second.done)); });
  waiters_.erase(first, last);
  return calls;
}

void Previews::evict_oldest(const std::string& id) {
  const auto [first, last] = of_job(entries_, id);
  if (static_cast<std::size_t>(std::distance(first, last)) < sides_max) return;
  entries_.erase(std::min_element(first, last,
                                  [](const auto& one, const auto& other) { return one.second.at < other.second.at; }));
}

// ---- JobWaiters

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
    const std::optional<JobSummary> job = jobs_.summary(id);
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
  if (request.is_new) runner_.request_preview(id, side);
  return request.token;
}

bool JobWaiters::request_own_preview(const std::string& id, std::uint32_t side, std::function<void()> done) {
  if (!previews_.is_running(id)) return false;
  if (previews_.request(id, side, std::move(done)).is_new)
    runner_.call([&](JobRunner& runner) { runner.request_preview(id, side); });
  return true;
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

void JobWaiters::wake_all() {
  std::map<std::uint64_t, Waiter> waiters;
  {
    const std::lock_guard lock(mutex_);
    waiters.swap(waiters_);
    tokens_.clear();
  }
  for (const auto& [token, waiter] : waiters) waiter.done();
}

}  // namespace queue
