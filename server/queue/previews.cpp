#include "server/queue/previews.h"

#include <algorithm>
#include <iterator>
#include <limits>

namespace queue {
namespace {

constexpr std::uint32_t all_sides = std::numeric_limits<std::uint32_t>::max();

/// Those of one job, of all sizes.
template <class Map>
auto of_job(Map& map, const std::string& id) {
  return std::pair(map.lower_bound({id, 0}), map.upper_bound({id, all_sides}));
}

}  // namespace

Previews::Latest Previews::latest(const std::string& id, std::uint32_t side) const {
  const std::int64_t now = clock_();
  const std::lock_guard lock(mutex_);
  const auto found = made_.find({id, side});
  if (found == made_.end()) return {};
  return {found->second.png, now - found->second.at <= fresh_ms};
}

Previews::Wish Previews::wish(const std::string& id, std::uint32_t side, std::function<void()> done) {
  const std::lock_guard lock(mutex_);
  const Key key{id, side};
  const bool is_new = !waiters_.contains(key);
  waiters_.emplace(key, Waiter{++last_token_, std::move(done)});
  return {last_token_, is_new};
}

void Previews::forget(std::uint64_t token) {
  const std::lock_guard lock(mutex_);
  const auto found =
      std::find_if(waiters_.begin(), waiters_.end(), [&](const auto& entry) { return entry.second.token == token; });
  if (found != waiters_.end()) waiters_.erase(found);
}

Previews::Calls Previews::came(const std::string& id, std::uint32_t side, std::string png) {
  const std::int64_t now = clock_();
  Calls calls;
  const std::lock_guard lock(mutex_);
  const Key key{id, side};
  if (!made_.contains(key)) make_room(id);
  made_.insert_or_assign(key, Made{std::make_shared<const std::string>(std::move(png)), now});
  const auto [first, last] = waiters_.equal_range(key);
  std::for_each(first, last, [&](auto& entry) { calls.push_back(std::move(entry.second.done)); });
  waiters_.erase(first, last);
  return calls;
}

Previews::Calls Previews::ended(const std::string& id) {
  Calls calls;
  const std::lock_guard lock(mutex_);
  const auto [first_made, last_made] = of_job(made_, id);
  made_.erase(first_made, last_made);
  const auto [first, last] = of_job(waiters_, id);
  std::for_each(first, last, [&](auto& entry) { calls.push_back(std::move(entry.second.done)); });
  waiters_.erase(first, last);
  return calls;
}

void Previews::make_room(const std::string& id) {
  const auto [first, last] = of_job(made_, id);
  if (static_cast<std::size_t>(std::distance(first, last)) < sides_max) return;
  made_.erase(std::min_element(first, last,
                               [](const auto& one, const auto& other) { return one.second.at < other.second.at; }));
}

}  // namespace queue
