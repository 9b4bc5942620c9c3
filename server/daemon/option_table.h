#pragma once
/// The one table of options: what can be set, to what, and why the default is what it is.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "server/daemon/config.h"

namespace whittled {

struct Count {
  std::uint64_t Config::*member;
  std::uint64_t least, most;
};
struct Endpoint {
  Address Config::*member;
};
struct Text {
  std::string Config::*member;
  bool may_be_empty = false;
  std::string_view range = "PATH";
};
struct Choice {
  std::string Config::*member;
  std::string_view choices;  ///< separated by '|'
};

struct Option {
  std::string_view name;
  std::string_view default_text;
  std::variant<Count, Endpoint, Text, Choice> kind;
  std::string_view reason;  ///< what it does and why the default
};

std::span<const Option> options();
const Option* find_option(std::string_view name);

/// Sets `option` in `config` from text. Empty when it fits, else the sentence that says why not.
std::string assign(const Option& option, std::string_view text, Config& config);

/// The value as it would be written.
std::string text_of(const Option& option, const Config& config);

/// 127.0.0.0/8 and ::1.
bool is_loopback(const std::string& host);

/// What may be written: "1..64", "ADDRESS:PORT", "debug|info|warning|error".
std::string range_of(const Option& option);

}  // namespace whittled
