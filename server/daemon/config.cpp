#include "server/daemon/config.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>

#include "server/daemon/option_table.h"
#include "server/keys/key_ring.h"

namespace whittled {
namespace {

constexpr std::size_t file_bytes_max = 1u << 20;  // a mistyped --config must not read a disk

struct Setting {
  std::string value;
  std::string where;
};
using Settings = std::map<std::string_view, Setting>;  // by option name

std::string flag_of(std::string_view name) {
  std::string flag = "--" + std::string(name);
  std::replace(flag.begin(), flag.end(), '_', '-');
  return flag;
}

std::string variable_of(std::string_view name) {
  std::string variable = "WHITTLE_";
  for (const char c : name) variable += c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  return variable;
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

struct Flags {
  Task task = Task::run;
  std::optional<std::string> file, new_key, scopes, backup;
  Settings settings;

  /// The flags that are no options.
  std::optional<std::string>* other(std::string_view flag) {
    if (flag == "--config") return &file;
    if (flag == "--new-key") return &new_key;
    if (flag == "--backup") return &backup;
    return flag == "--scopes" ? &scopes : nullptr;
  }
};

Flags read_flags(const std::vector<std::string>& arguments, std::vector<ConfigError>& errors) {
  Flags flags;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    const std::size_t equals = argument.find('=');
    const std::string flag = argument.substr(0, equals);
    if (argument == "--help") flags.task = Task::help;
    if (argument == "--version") flags.task = Task::version;
    if (argument == "--check-config") flags.task = Task::check;
    if (argument == "--probe") flags.task = Task::probe;
    if (argument == "--help" || argument == "--version" || argument == "--check-config" || argument == "--probe") {
      continue;
    }

    std::string name = flag.starts_with("--") ? flag.substr(2) : "";
    std::replace(name.begin(), name.end(), '-', '_');
    const Option* option = find_option(name);
    std::optional<std::string>* const other = flags.other(flag);
    if (option == nullptr && other == nullptr) {
      errors.push_back({flag, "is no option; --help lists them"});
      continue;
    }
    if (equals == std::string::npos && i + 1 == arguments.size()) {
      errors.push_back({flag, "needs a value"});
      continue;
    }
    const std::string value = equals == std::string::npos ? arguments[++i] : argument.substr(equals + 1);
    if (option == nullptr) {
      *other = value;
    } else if (!flags.settings.emplace(option->name, Setting{value, flag}).second) {
      errors.push_back({flag, "is given twice"});
    }
  }
  return flags;
}

Settings read_environment(const Environment& environment, std::vector<std::string>& ignored) {
  Settings settings;
  const auto all = options();
  for (const auto& entry : environment) {
    const auto found = std::find_if(all.begin(), all.end(),
                                    [&](const Option& option) { return variable_of(option.name) == entry.first; });
    if (found == all.end()) {
      ignored.push_back(entry.first);
    } else {
      settings.emplace(found->name, Setting{entry.second, entry.first});
    }
  }
  return settings;
}

void read_line(std::string_view line, const std::string& where, Settings& settings, std::vector<ConfigError>& errors) {
  line = trimmed(line.substr(0, line.find('#')));
  if (line.empty()) return;
  const std::size_t equals = line.find('=');
  if (equals == std::string_view::npos) {
    errors.push_back({where, "must be \"name = value\", got \"" + std::string(line) + "\""});
    return;
  }
  const std::string_view name = trimmed(line.substr(0, equals));
  const Option* option = find_option(name);
  if (option == nullptr) {
    errors.push_back({where, "\"" + std::string(name) + "\" is no option; --help lists them"});
  } else if (!settings.emplace(option->name, Setting{std::string(trimmed(line.substr(equals + 1))), where}).second) {
    errors.push_back({where, "\"" + std::string(name) + "\" is given twice"});
  }
}

Settings read_file(const std::string& path, std::vector<ConfigError>& errors) {
  Settings settings;
  std::ifstream file(path, std::ios::binary);
  std::string text(file_bytes_max + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(std::max<std::streamsize>(file.gcount(), 0)));
  if (!file.is_open() || file.bad() || (text.empty() && !file.eof())) {
    errors.push_back({"--config", "cannot read \"" + path + "\""});
    return settings;
  }
  if (text.size() > file_bytes_max) {
    errors.push_back({"--config", "\"" + path + "\" is longer than 1 MiB"});
    return settings;
  }
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    read_line(line, path + ":" + std::to_string(number), settings, errors);
  }
  return settings;
}

/// The strongest source that sets each option wins; weaker ones are checked as well, for a mistake is a mistake.
Config resolve(const std::vector<Settings>& weakest_first, std::vector<ConfigError>& errors) {
  Config config;
  for (const Option& option : options()) {
    assign(option, option.default_text, config);
    for (const Settings& settings : weakest_first) {
      const auto found = settings.find(option.name);
      if (found == settings.end()) continue;
      const std::string sentence = assign(option, found->second.value, config);
      if (!sentence.empty()) errors.push_back({found->second.where, sentence});
    }
  }
  return config;
}

void check_reach(const Config& config, const std::vector<Settings>& weakest_first, std::vector<ConfigError>& errors) {
  if (!config.keys.empty()) return;
  for (const auto& [name, address] : {std::pair("listen", config.listen), {"health_listen", config.health_listen}}) {
    if (is_loopback(address.host)) continue;
    std::string where;
    for (const Settings& settings : weakest_first) {
      const auto found = settings.find(name);
      if (found != settings.end()) where = found->second.where;
    }
    errors.push_back({where, "must be a loopback address (127.0.0.1, [::1]), got " + address.host +
                                 ": without keys anyone who reaches the port may use the daemon; see --keys"});
  }
}

void read_new_key(const Flags& flags, Command& command, std::vector<ConfigError>& errors) {
  if (!flags.new_key) {
    if (flags.scopes) errors.push_back({"--scopes", "are those of a --new-key"});
    return;
  }
  command.task = Task::new_key;
  command.key_name = *flags.new_key;
  command.key_scopes = flags.scopes.value_or("jobs:read,jobs:write");
  if (!keys::is_name(command.key_name)) {
    errors.push_back({"--new-key", "the name must be 1 to 64 of A-Z a-z 0-9 . _ -, got \"" + command.key_name + '"'});
  }
  if (!keys::parse_scopes(command.key_scopes)) {
    errors.push_back({"--scopes", "must be some of jobs:read,jobs:write,admin, got \"" + command.key_scopes + '"'});
  }
  if (command.config.keys.empty()) errors.push_back({"--new-key", "needs --keys: the file that the key is added to"});
}

}  // namespace

tracer::Result<Command, std::vector<ConfigError>> read_command(const std::vector<std::string>& arguments,
                                                               const Environment& environment) {
  std::vector<ConfigError> errors;
  const Flags flags = read_flags(arguments, errors);
  Command command;
  command.task = flags.task;
  if (flags.task == Task::help || flags.task == Task::version) return command;
  const Settings variables = read_environment(environment, command.ignored_variables);
  const Settings lines = flags.file ? read_file(*flags.file, errors) : Settings{};
  const std::vector<Settings> weakest_first{lines, variables, flags.settings};
  command.config = resolve(weakest_first, errors);
  if (command.config.listen.port != 0 && command.config.listen == command.config.health_listen) {
    errors.push_back(
        {"health_listen", "must differ from listen, both are " + text_of(*find_option("listen"), command.config)});
  }
  if (flags.backup) {
    command.task = Task::backup;
    command.backup_directory = *flags.backup;
    if (command.backup_directory.empty()) errors.push_back({"--backup", "needs the name of a new directory"});
  }
  const bool listens = command.task != Task::probe && command.task != Task::backup;
  if (listens) check_reach(command.config, weakest_first, errors);
  read_new_key(flags, command, errors);
  if (!errors.empty()) return errors;
  return command;
}

Environment process_environment() {
  Environment ours;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view text = *entry;
    const std::size_t equals = text.find('=');
    if (!text.starts_with("WHITTLE_") || equals == std::string_view::npos) continue;
    ours.emplace_back(text.substr(0, equals), text.substr(equals + 1));
  }
  return ours;
}

std::string help_text() {
  std::string text =
      "whittled: takes JSON scenes over HTTP, keeps them as jobs, answers images.\n\n"
      "  whittled [--NAME VALUE ...] [--config FILE]\n"
      "  whittled --check-config ...   says every mistake, or the settings, and ends\n"
      "  whittled --new-key NAME [--scopes jobs:read,jobs:write,admin] --keys FILE   shows a new key, once; FILE - is "
      "stdout\n"
      "  whittled --probe              asks the daemon on health_listen whether it is ready: 0 when it is, else 1\n"
      "  whittled --backup DIRECTORY      copies the data directory, whose daemon may go on, into a new one\n"
      "  whittled --version | --help\n\n"
      "A flag --some-name beats the environment's WHITTLE_SOME_NAME beats the file's line \"some_name = value\".\n\n";
  for (const Option& option : options()) {
    text += "  " + flag_of(option.name) + " " + range_of(option) + "   (default " +
            (option.default_text.empty() ? "none" : std::string(option.default_text)) + ")\n      " +
            std::string(option.reason) + "\n";
  }
  return text;
}

std::vector<std::pair<std::string, std::string>> settings(const Config& config) {
  std::vector<std::pair<std::string, std::string>> all;
  for (const Option& option : options()) all.emplace_back(option.name, text_of(option, config));
  return all;
}

}  // namespace whittled
