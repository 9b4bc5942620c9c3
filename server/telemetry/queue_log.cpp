#include "server/telemetry/queue_log.h"

#include <vector>

namespace telemetry {
namespace {

Level level_of(jobs::LogLevel level) {
  switch (level) {
    case jobs::LogLevel::debug:
      return Level::debug;
    case jobs::LogLevel::info:
      return Level::info;
    case jobs::LogLevel::warning:
      return Level::warning;
    case jobs::LogLevel::error:
      return Level::error;
  }
  return Level::error;
}

}  // namespace

jobs::Log queue_log(const Log& log) {
  return [log](jobs::LogLevel level, std::string_view event, const jobs::LogFields& fields) {
    std::vector<Field> typed;
    typed.reserve(fields.size());
    for (const auto& [name, value] : fields) typed.push_back({name, std::string_view(value)});
    log.write(level_of(level), event, typed);
  };
}

}  // namespace telemetry
