#pragma once
/// The one table of options: name, default, range, and the reason of the default.

#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "server/daemon/config.h"

namespace whittled {

struct Option {
  std::string_view name, default_text;
  std::variant<std::uint64_t Config::*, std::string Config::*, Address Config::*> member;
  /// The meaning of a text, or all its allowed values separated by '|'. The text may be empty if its default is.
  std::string_view values;
  std::uint64_t least, most;  ///< range of a number
  std::string_view help;      ///< the effect, and the reason of the default

  [[nodiscard]] std::string range() const;                     ///< the allowed values
  [[nodiscard]] std::string text(const Config& config) const;  ///< the value as it would be written
  /// Sets the value, or returns the rule that `text` violates.
  [[nodiscard]] std::string assign(std::string_view text, Config& config) const;
};

std::span<const Option> options();
const Option* find_option(std::string_view name);  ///< null if there is none

/// 127.0.0.0/8 and ::1.
bool is_loopback(const std::string& host);

}  // namespace whittled
