#pragma once
/// The daemon's log: one JSON object a line on stderr, for programs to read and people to grep.
///
/// Every line has `time` (RFC 3339 UTC, milliseconds), `level`, `event` (a stable name such as "request"), then the
/// fields given. Text may come from anyone: it is escaped so that a line stays a line (CR, LF, ESC and every other
/// control character, DEL, invalid UTF-8), and cut at 4 KiB. Values are cheap to copy and share one sink; writing is
/// thread-safe, never throws, and waits only for stderr.

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

namespace telemetry {

enum class Level { debug, info, warning, error };
std::string_view name_of(Level level);
std::optional<Level> level_named(std::string_view name);

struct Field {
  std::string_view name;  ///< of api/docs/http.md and the structs: request_id, job_id, status, duration_ms
  std::variant<std::string_view, std::int64_t, double, bool> value;
};

/// The line without its end. `unix_ms` is the time it tells. Pure: what a logger writes can be tested.
std::string json_line(std::int64_t unix_ms, Level level, std::string_view event, std::span<const Field> fields);

class Log {
 public:
  explicit Log(Level least);

  void write(Level level, std::string_view event, std::initializer_list<Field> fields) const noexcept {
    write(level, event, std::span(fields.begin(), fields.size()));
  }
  void write(Level level, std::string_view event, std::span<const Field> fields) const noexcept;

 private:
  struct Sink;
  std::shared_ptr<Sink> sink_;
};

}  // namespace telemetry
