#pragma once
/// The one table of options: name, default, range, and the reason of the default.

#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "server/daemon/config.h"

namespace whittled {

// Every kind of value has: range() for the help, text() as it would be written, and assign(), which returns the rule
// that the text violates, or nothing.

struct Count {
  std::uint64_t Config::*member;
  std::uint64_t least, most;

  [[nodiscard]] std::string range() const;
  [[nodiscard]] std::string text(const Config& config) const { return std::to_string(config.*member); }
  [[nodiscard]] std::string assign(std::string_view text, Config& config) const;
};

struct Endpoint {
  Address Config::*member;

  [[nodiscard]] static std::string range() { return "ADDRESS:PORT"; }
  [[nodiscard]] std::string text(const Config& config) const;
  [[nodiscard]] std::string assign(std::string_view text, Config& config) const;
};

struct Text {
  std::string Config::*member;
  std::string_view meaning = "PATH";
  bool required = false;  ///< it must not be empty

  [[nodiscard]] std::string range() const { return std::string(meaning); }
  [[nodiscard]] std::string text(const Config& config) const { return config.*member; }
  [[nodiscard]] std::string assign(std::string_view text, Config& config) const;
};

struct LogLevel {
  std::string Config::*member;

  [[nodiscard]] static std::string range() { return "debug|info|warning|error"; }
  [[nodiscard]] std::string text(const Config& config) const { return config.*member; }
  [[nodiscard]] std::string assign(std::string_view text, Config& config) const;
};

struct Option {
  std::string_view name, default_text;
  std::variant<Count, Endpoint, Text, LogLevel> kind;
  std::string_view help;  ///< the effect, and the reason of the default

  [[nodiscard]] std::string range() const;
  [[nodiscard]] std::string text(const Config& config) const;
  [[nodiscard]] std::string assign(std::string_view text, Config& config) const;
};

std::span<const Option> options();
const Option* find_option(std::string_view name);  ///< null if there is none

/// 127.0.0.0/8 and ::1.
bool is_loopback(const std::string& host);

}  // namespace whittled
