#pragma once
/// Which failures are worth another attempt, and after what pause. A pure function, so the rule is in one place and
/// tested as a table.

#include <chrono>
#include <optional>
#include <string>

namespace worker {

struct RetrySettings {
  /// Before the second attempt; four times as long before each further one. What was short of memory or time a moment
  /// ago is so still.
  std::chrono::milliseconds pause{1'000};
  std::chrono::milliseconds pause_max{60'000};
};

/// The pause before the next attempt of a job whose `attempt`th failed with `code`. Nothing where there is no next one:
/// it was the last, or the failure is the job's own ("bad_scene", "bad_asset", "deadline_exceeded") and would come
/// again. The machine may be to blame for "out_of_memory", "timed_out", "worker_crashed",
/// "storage_failure" and "internal".
std::optional<std::chrono::milliseconds> retry_pause(const std::string& code, int attempt, int max_attempts,
                                                     const RetrySettings& settings);

}  // namespace worker
