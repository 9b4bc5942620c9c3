#include "server/queue/previews.h"

#include <algorithm>
#include <iterator>
#include <limits>

namespace queue {
namespace {

constexpr std::uint32_t all_sides = std::numeric_limits<std::uint32_t>::max();

/// All sizes of one job.
template <class Map>
auto of_job(Map& map, const std::string& id) {
  return std::pair(map.lower_bound({id, 0}), map.upper_bound({id, all_sides}));
}

}  // namespace

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

Previews::Calls Previews::add(const std::string& id, std::uint32_t side, std::string png) {
  const std::int64_t now = clock_();
  Calls calls;
  const std::lock_guard lock(mutex_);
  if (!running_.contains(id)) return calls;
  const Key key{id, side};
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

}  // namespace queue
