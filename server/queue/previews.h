#pragma once
/// Images of running jobs as far as they are, kept in memory while somebody looks. Nothing is made, and nothing kept,
/// of jobs that nobody watches.

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/queue/clock.h"

namespace queue {

/// Pixels along the longer side. With alpha and all noise that is 4 MB.
inline constexpr std::uint32_t preview_side_max = 1024;

/// Thread-safe. A job has at most `sides_max` images here, of different sizes; the oldest goes.
class Previews {
 public:
  using Png = std::shared_ptr<const std::string>;
  using Calls = std::vector<std::function<void()>>;
  static constexpr std::size_t sides_max = 4;
  /// An image is good for so long: it is what bounds how often a job is looked at.
  static constexpr std::int64_t fresh_ms = 500;

  explicit Previews(Clock clock) : clock_(std::move(clock)) {}

  struct Latest {
    Png png;             ///< null: there is none
    bool fresh = false;  ///< not older than fresh_ms
  };
  [[nodiscard]] Latest latest(const std::string& id, std::uint32_t side) const;

  struct Wish {
    std::uint64_t token = 0;  ///< for `forget`
    bool is_new = false;      ///< nobody waits for the same yet: whoever makes it is to be told
  };
  /// `done` is among the calls of the next `came` of that size, or of `ended`.
  Wish wish(const std::string& id, std::uint32_t side, std::function<void()> done);
  void forget(std::uint64_t token);

  /// To be called by the caller, with no lock of its own held.
  [[nodiscard]] Calls came(const std::string& id, std::uint32_t side, std::string png);
  [[nodiscard]] Calls ended(const std::string& id);  ///< nothing of the job stays

 private:
  using Key = std::pair<std::string, std::uint32_t>;
  struct Made {
    Png png;
    std::int64_t at = 0;
  };
  struct Waiter {
    std::uint64_t token = 0;
    std::function<void()> done;
  };

  void make_room(const std::string& id);

  const Clock clock_;
  mutable std::mutex mutex_;
  std::map<Key, Made> made_;
  std::multimap<Key, Waiter> waiters_;
  std::uint64_t last_token_ = 0;
};

}  // namespace queue
