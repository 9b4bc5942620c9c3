#include "server/telemetry/json_log.h"

#include <spdlog/logger.h>
#include <spdlog/sinks/stdout_sinks.h>

#include <chrono>

namespace telemetry {
namespace {

spdlog::level::level_enum spdlog_level(Level level) {
  switch (level) {
    case Level::debug:
      return spdlog::level::debug;
    case Level::info:
      return spdlog::level::info;
    case Level::warning:
      return spdlog::level::warn;
    case Level::error:
      return spdlog::level::err;
  }
  return spdlog::level::err;
}

}  // namespace

struct Log::Sink {
  spdlog::logger logger{"whittled", std::make_shared<spdlog::sinks::stderr_sink_mt>()};
};

Log::Log(Level least) : sink_(std::make_shared<Sink>()) {
  sink_->logger.set_level(spdlog_level(least));
  sink_->logger.set_pattern("%v");                             // the whole line is ours
  sink_->logger.set_error_handler([](const std::string&) {});  // stderr is gone: nobody is left to tell
}

void Log::write(Level level, std::string_view event, std::span<const Field> fields) const noexcept {
  if (!sink_->logger.should_log(spdlog_level(level))) return;
  try {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    const auto unix_ms = std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
    sink_->logger.log(spdlog_level(level), json_line(unix_ms, level, event, fields));
  } catch (...) {
    // Out of memory while telling something: losing the line is the lesser harm.
  }
}

}  // namespace telemetry
