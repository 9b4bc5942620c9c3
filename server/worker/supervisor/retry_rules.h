#pragma once
/// Decides which failures are followed by another attempt, and after which pause. A pure function, tested as a table.

#include <chrono>
#include <optional>
#include <string>

namespace worker {

struct RetrySettings {
  /// Before the second attempt, and four times as long before each further one: a lack of memory or time rarely ends
  /// at once.
  std::chrono::milliseconds pause{1'000};
  std::chrono::milliseconds pause_max{60'000};
};

/// The pause before the attempt that follows a failure with `code`. None after the last attempt and for failures that
/// the job itself causes ("bad_scene", "bad_asset", "deadline_exceeded"). Transient are "out_of_memory", "timed_out",
/// "worker_crashed", "storage_failure" and "internal".
std::optional<std::chrono::milliseconds> retry_pause(const std::string& code, int attempt, int max_attempts,
                                                     const RetrySettings& settings);

}  // namespace worker
