#include "server/telemetry/queue_log.h"

#include <vector>

namespace telemetry {
namespace {

Level level_of(queue::LogLevel level) {
  switch (level) {
    case queue::LogLevel::debug:
      return Level::debug;
    case queue::LogLevel::info:
      return Level::info;
    case queue::LogLevel::warning:
      return Level::warning;
    case queue::LogLevel::error:
      return Level::error;
  }
  return Level::error;
}

}  // namespace

queue::Log queue_log(const Log& log) {
  return [log](queue::LogLevel level, std::string_view event, const queue::LogFields& fields) {
    std::vector<Field> typed;
    typed.reserve(fields.size());
    for (const auto& [name, value] : fields) typed.push_back({name, std::string_view(value)});
    log.write(level_of(level), event, typed);
  };
}

}  // namespace telemetry
