#include "server/worker/supervisor/retry_rules.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace worker {
namespace {

constexpr std::array<std::string_view, 5> transient_codes{"out_of_memory", "timed_out", "worker_crashed",
                                                          "storage_failure", "internal"};

}  // namespace

std::optional<std::chrono::milliseconds> retry_pause(const std::string& code, int attempt, int max_attempts,
                                                     const RetrySettings& settings) {
  const bool transient = std::find(transient_codes.begin(), transient_codes.end(), code) != transient_codes.end();
  if (!transient || attempt >= max_attempts) return std::nullopt;
  std::chrono::milliseconds pause = settings.pause;
  for (int i = 1; i < attempt && pause < settings.pause_max; ++i) pause *= 4;
  return std::min(pause, settings.pause_max);
}

}  // namespace worker
