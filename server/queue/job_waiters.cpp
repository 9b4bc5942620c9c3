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
  const bool is_new = !waits({id, side});
  const Token token{id, side, ++last_number_};
  waiters_.emplace(token, std::move(done));
  return {token, is_new};
}

void Previews::cancel(const Token& token) {
  const std::lock_guard lock(mutex_);
  waiters_.erase(token);
}

bool Previews::is_running(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  return running_.contains(id);
}

bool Previews::is_requested(const std::string& id, std::uint32_t side) const {
  const std::lock_guard lock(mutex_);
  return waits({id, side});
}

Previews::Calls Previews::add(const std::string& id, std::uint32_t side, std::string png) {
  const std::int64_t now = clock_();
  const std::lock_guard lock(mutex_);
  const Key key{id, side};
  if (!running_.contains(id) && !waits(key)) return {};
  if (!entries_.contains(key)) evict_oldest(id);
  entries_.insert_or_assign(key, Entry{std::make_shared<const std::string>(std::move(png)), now});
  return take(id, side, side);
}

Previews::Calls Previews::end(const std::string& id) {
  const std::lock_guard lock(mutex_);
  running_.erase(id);
  const auto [first, last] = of_job(entries_, id);
  entries_.erase(first, last);
  return take(id, at_end + 1, all_sides);
}

Previews::Calls Previews::ended(const std::string& id) {
  const std::lock_guard lock(mutex_);
  return take(id, at_end, at_end);
}

Previews::Calls Previews::all_at_end() {
  Calls calls;
  const std::lock_guard lock(mutex_);
  for (auto& [token, done] : waiters_)
    if (std::get<1>(token) == at_end) calls.push_back(std::move(done));
  std::erase_if(waiters_, [](const auto& waiter) { return std::get<1>(waiter.first) == at_end; });
  return calls;
}

bool Previews::waits(const Key& key) const {
  const auto next = waiters_.lower_bound({key.first, key.second, 0});
  return next != waiters_.end() && Key(std::get<0>(next->first), std::get<1>(next->first)) == key;
}

Previews::Calls Previews::take(const std::string& id, std::uint32_t first_side, std::uint32_t last_side) {
  Calls calls;
  const auto first = waiters_.lower_bound({id, first_side, 0}),
             last = waiters_.upper_bound({id, last_side, last_number_});
  std::for_each(first, last, [&](auto& waiter) { calls.push_back(std::move(waiter.second)); });
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

Previews::Token JobWaiters::when_ended(const std::string& id, std::function<void()> done) {
  Previews::Token token = previews_.request(id, Previews::at_end, std::move(done)).token;
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

Previews::Token JobWaiters::request_preview(const std::string& id, std::uint32_t side, std::function<void()> done) {
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
  for (const auto& call : previews_.ended(id)) call();
  on_stopped(id);
}

void JobWaiters::wake_all() {
  for (const auto& call : previews_.all_at_end()) call();
}

}  // namespace queue
