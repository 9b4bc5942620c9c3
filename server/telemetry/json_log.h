#pragma once
/// The daemon's log: one JSON object per line on stderr.
///
/// Every line has `time` (RFC 3339 UTC, milliseconds), `level`, `event` (a stable name such as "request"), then the
/// given fields. Text may be untrusted: control characters (CR, LF, ESC, DEL and all others) and invalid UTF-8 are
/// replaced, and text over 4 KiB is cut. Values are cheap to copy and share one sink; writing is thread-safe, never
/// throws, and waits only for stderr.

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "server/queue/event_log.h"

namespace telemetry {

using Level = queue::LogLevel;
std::string_view name_of(Level level);
std::optional<Level> level_named(std::string_view name);

struct Field {
  std::string_view name;  ///< as in api/docs/http.md and the structs: request_id, job_id, status, duration_ms
  std::variant<std::string_view, std::int64_t, double, bool> value;
};

/// One line without its newline. Pure, for tests.
std::string json_line(std::int64_t unix_ms, Level level, std::string_view event, std::span<const Field> fields);

class Log {
 public:
  explicit Log(Level level_min);

  void write(Level level, std::string_view event, std::initializer_list<Field> fields) const noexcept {
    write(level, event, std::span(fields.begin(), fields.size()));
  }
  void write(Level level, std::string_view event, std::span<const Field> fields) const noexcept;

 private:
  struct Sink;
  std::shared_ptr<Sink> sink_;
};

/// The log of the queue, its stores and the supervisor. Shares the sink of `log`; values are written as text.
queue::Log queue_log(const Log& log);

}  // namespace telemetry
