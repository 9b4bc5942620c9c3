#pragma once
/// The log of the queue, its stores and the worker's supervisor; the daemon binds it to its logger.

#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace queue {

enum class LogLevel { debug, info, warning, error };

/// Keys are the names of api/docs/http.md and the structs ("job_id", "attempt", "signal"). Values are raw: the
/// logger escapes them.
using LogFields = std::vector<std::pair<std::string_view, std::string>>;

/// `event` is a stable name such as "worker_died". Called from any thread, concurrently; must not throw.
using Log = std::function<void(LogLevel level, std::string_view event, const LogFields& fields)>;

inline Log no_log() {
  return [](LogLevel, std::string_view, const LogFields&) {};
}

}  // namespace queue
