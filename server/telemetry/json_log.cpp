#include "server/telemetry/json_log.h"

#include <spdlog/fmt/chrono.h>
#include <spdlog/logger.h>
#include <spdlog/sinks/stdout_sinks.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <vector>

namespace telemetry {
namespace {

constexpr std::size_t text_bytes_max = 4096;

/// Length of the well-formed UTF-8 sequence that starts `text`, or 0 (Unicode 15, table 3-7).
std::size_t utf8_sequence(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const auto within = [&](std::size_t i, unsigned low, unsigned high) {
    return i < text.size() && byte(i) >= low && byte(i) <= high;
  };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  if (first >= 0xc2 && first <= 0xdf) return within(1, 0x80, 0xbf) ? 2 : 0;
  if (first >= 0xe0 && first <= 0xef) {
    const unsigned low = first == 0xe0 ? 0xa0 : 0x80, high = first == 0xed ? 0x9f : 0xbf;
    return within(1, low, high) && within(2, 0x80, 0xbf) ? 3 : 0;
  }
  if (first >= 0xf0 && first <= 0xf4) {
    const unsigned low = first == 0xf0 ? 0x90 : 0x80, high = first == 0xf4 ? 0x8f : 0xbf;
    return within(1, low, high) && within(2, 0x80, 0xbf) && within(3, 0x80, 0xbf) ? 4 : 0;
  }
  return 0;
}

void append_text(std::string& line, std::string_view text) {
  const bool cut = text.size() > text_bytes_max;
  if (cut) text = text.substr(0, text_bytes_max);
  line += '"';
  while (!text.empty()) {
    const std::size_t length = utf8_sequence(text);
    const auto first = static_cast<unsigned char>(text[0]);
    // C1 controls (U+0080..U+009F) are escape sequences to some terminals.
    const bool c1 = length == 2 && first == 0xc2 && static_cast<unsigned char>(text[1]) < 0xa0;
    if (length == 0) {
      line += "\xef\xbf\xbd";  // U+FFFD for the byte that is no UTF-8
    } else if (first == '"' || first == '\\') {
      line += '\\';
      line += text[0];
    } else if (first < 0x20 || first == 0x7f || c1) {
      line += fmt::format("\\u{:04x}", static_cast<unsigned char>(text[c1 ? 1 : 0]));
    } else {
      line += text.substr(0, length);
    }
    text.remove_prefix(length == 0 ? 1 : length);
  }
  line += cut ? "...\"" : "\"";
}

/// In the order of Level.
constexpr std::array<std::string_view, 4> level_names{"debug", "info", "warning", "error"};
constexpr std::array spdlog_levels{spdlog::level::debug, spdlog::level::info, spdlog::level::warn, spdlog::level::err};

spdlog::level::level_enum spdlog_level(Level level) { return spdlog_levels[static_cast<std::size_t>(level)]; }

}  // namespace

std::string_view name_of(Level level) { return level_names[static_cast<std::size_t>(level)]; }

std::optional<Level> level_named(std::string_view name) {
  const auto found = std::ranges::find(level_names, name);
  return found == level_names.end() ? std::nullopt : std::optional(static_cast<Level>(found - level_names.begin()));
}

std::string json_line(std::int64_t unix_ms, Level level, std::string_view event, std::span<const Field> fields) {
  std::string line = fmt::format(R"({{"time":"{:%FT%T}.{:03}Z","level":"{}","event":)", fmt::gmtime(unix_ms / 1000),
                                 unix_ms % 1000, name_of(level));
  append_text(line, event);
  for (const Field& field : fields) {
    line += ',';
    append_text(line, field.name);
    line += ':';
    if (const auto* text = std::get_if<std::string_view>(&field.value)) append_text(line, *text);
    if (const auto* count = std::get_if<std::int64_t>(&field.value)) line += std::to_string(*count);
    if (const auto* number = std::get_if<double>(&field.value)) {
      line += std::isfinite(*number) ? fmt::format("{:.6g}", *number) : "null";  // JSON has no infinities
    }
    if (const auto* truth = std::get_if<bool>(&field.value)) line += *truth ? "true" : "false";
  }
  return line + '}';
}

struct Log::Sink {
  spdlog::logger logger{"whittled", std::make_shared<spdlog::sinks::stderr_sink_mt>()};
};

Log::Log(Level level_min) : sink_(std::make_shared<Sink>()) {
  sink_->logger.set_level(spdlog_level(level_min));
  sink_->logger.set_pattern("%v");                             // json_line makes the whole line
  sink_->logger.set_error_handler([](const std::string&) {});  // stderr is closed
}

void Log::write(Level level, std::string_view event, std::span<const Field> fields) const noexcept {
  if (!sink_->logger.should_log(spdlog_level(level))) return;
  try {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    const auto unix_ms = std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
    sink_->logger.log(spdlog_level(level), json_line(unix_ms, level, event, fields));
  } catch (...) {
    // Out of memory: the line is lost.
  }
}

queue::Log queue_log(const Log& log) {
  return [log](Level level, std::string_view event, const queue::LogFields& fields) {
    std::vector<Field> typed;
    for (const auto& [name, value] : fields) typed.push_back({name, std::string_view(value)});
    log.write(level, event, typed);
  };
}

}  // namespace telemetry
