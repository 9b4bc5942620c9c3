#include "server/daemon/config.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <optional>
#include <regex>
#include <sstream>
#include <stdexcept>

#include "server/keys/key_ring.h"
#include "server/support/read_file.h"
#include "server/support/text_values.h"

namespace whittled {
namespace {

using Errors = std::vector<ConfigError>;

/// One value of an option, before it is checked.
struct Setting {
  const Option* option;
  std::string value, where;
};
using Settings = std::vector<Setting>;

constexpr const char* unknown_option = "is no option; --help lists them";

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

/// The command line before its values are checked. Set by the callbacks of the App, so it must not be moved.
struct Arguments {
  Command command;
  Settings settings;
  Errors errors;
};

void add_tasks(CLI::App& app, Command& command) {
  // Not add_option: it would take an empty value for none.
  const auto add_text = [&](const char* flag, std::optional<std::string>& into, const char* type, const char* help) {
    app.add_option_function<std::string>(
           flag, [&into](const std::string& value) { into = value; }, help)
        ->type_name(type);
  };
  add_text("--config", command.config_file, "FILE", "file of lines \"some_name = value\"");
  add_text("--new-key", command.new_key, "NAME", "print a new key, once, and append its hash to --keys (- is stdout)");
  add_text("--scopes", command.scopes, "jobs:read,jobs:write,admin",
           "scopes of the new key, by default jobs:read,jobs:write");
  add_text("--backup", command.backup, "DIRECTORY", "copy the data, also of a running daemon, into a new directory");
  add_text("--copy-to", command.copy_to, "URI|DIRECTORY",
           "copy the data of a stopped daemon: those of --data to a PostgreSQL database and --artifacts, or those of "
           "--database and --artifacts to a new directory");
  const auto add_task = [&](const char* flag, Task task, const char* help) {
    app.add_flag_callback(
        flag, [&command, task] { command.task = task; }, help);
  };
  add_task("--check-config", Task::check, "print all errors, or the effective settings, and exit");
  add_task("--probe", Task::probe, "query /readyz of health_listen: exit code 0 if the daemon is ready, else 1");
  add_task("--version", Task::version, "print the version and exit");
  add_task("--help", Task::help, "print this help and exit");
}

void add_options(CLI::App& app, Arguments& arguments) {
  for (const Option& option : options()) {
    const std::string flag = flag_of(option.name);
    const auto collect = [&arguments, &option, flag](const CLI::results_t& values) {
      if (values.size() > 1) arguments.errors.push_back({flag, "is given twice"});
      arguments.settings.push_back({&option, values.front(), flag});
      return true;
    };
    const std::string default_text(option.default_text.empty() ? "none" : option.default_text);
    app.add_option(flag, CLI::callback_t(collect), std::string(option.help))
        ->type_name(option.range() + " (default " + default_text + ")")
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  }
}

void define(CLI::App& app, Arguments& arguments) {
  app.set_help_flag();  // help is a task, so that it takes precedence over errors
  app.allow_extras();
  app.get_formatter()->column_width(6);
  app.option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  app.footer("--some-name overrides WHITTLE_SOME_NAME in the environment, which overrides some_name in the file.");
  add_tasks(app, arguments.command);
  add_options(app, arguments);
}

/// The arguments in reverse order, as CLI11 takes them, with dashes for underscores in flags, and without two of its
/// readings: "--name=" would take the next argument as its value, and "--help=no" would be a flag that is not set.
std::vector<std::string> prepare(const CLI::App& app, const std::vector<std::string>& words, Errors& errors) {
  std::vector<std::string> prepared;
  for (const std::string& word : words) {
    const std::size_t equals = std::min(word.find('='), word.size());
    const std::string flag = word.starts_with("--") ? flag_of(word.substr(2, equals - 2)) : "";
    const CLI::Option* const option = app.get_option_no_throw(flag);
    if (option == nullptr) {
      prepared.push_back(word);
    } else if (equals < word.size() && option->get_items_expected_max() == 0) {
      errors.push_back({flag, "takes no value"});
    } else {
      prepared.push_back(flag);
      if (equals < word.size()) prepared.push_back(word.substr(equals + 1));
    }
  }
  std::ranges::reverse(prepared);
  return prepared;
}

void parse(const std::vector<std::string>& words, Arguments& arguments) {
  CLI::App app;
  define(app, arguments);
  std::vector<std::string> prepared = prepare(app, words, arguments.errors);
  std::string without_value;
  try {
    app.parse(std::vector<std::string>(prepared));
  } catch (const CLI::ArgumentMismatch&) {  // only the last argument can lack its value
    without_value = prepared.front();
    prepared.erase(prepared.begin());
    app.parse(std::move(prepared));
  }
  for (const std::string& extra : app.remaining()) {
    arguments.errors.push_back({extra.substr(0, extra.find('=')), unknown_option});
  }
  if (!without_value.empty()) arguments.errors.push_back({without_value, "needs a value"});
}

void read_environment(const Environment& environment, Settings& settings, std::vector<std::string>& unknown) {
  const auto all = options();
  for (const auto& [name, value] : environment) {
    const auto found = std::ranges::find(all, name, [](const Option& option) { return variable_of(option.name); });
    if (found == all.end()) {
      unknown.push_back(name);
    } else {
      settings.push_back({&*found, value, name});
    }
  }
}

void read_line(std::string_view line, const std::string& where, Settings& settings, Errors& errors) {
  const std::string content(support::trimmed(line.substr(0, line.find('#'))));
  if (content.empty()) return;
  const std::size_t equals = content.find('=');
  if (equals == std::string::npos) {
    errors.push_back({where, "must be \"name = value\", got \"" + content + "\""});
    return;
  }
  const std::string name(support::trimmed(content.substr(0, equals)));
  const Option* const option = find_option(name);
  const bool duplicate = std::ranges::find(settings, option, &Setting::option) != settings.end();
  if (option == nullptr) {
    errors.push_back({where, "\"" + name + "\" " + unknown_option});
  } else if (duplicate) {
    errors.push_back({where, "\"" + name + "\" is given twice"});
  } else {
    settings.push_back({option, std::string(support::trimmed(content.substr(equals + 1))), where});
  }
}

void read_config_file(const std::string& path, Settings& settings, Errors& errors) {
  try {
    std::istringstream lines(support::read_file(path));
    std::string line;
    for (int number = 1; std::getline(lines, line); ++number) {
      read_line(line, path + ":" + std::to_string(number), settings, errors);
    }
  } catch (const std::runtime_error& failure) {
    errors.push_back({"--config", failure.what()});
  }
}

/// The last setting of each option decides; all are checked.
Config resolve(const Settings& weakest_first, Errors& errors) {
  Config config;
  for (const Option& option : options()) (void)option.assign(option.default_text, config);
  for (const auto& [option, value, where] : weakest_first) {
    const std::string sentence = option->assign(value, config);
    if (!sentence.empty()) errors.push_back({where, sentence});
  }
  return config;
}

/// Without keys only loopback addresses are allowed.
void check_listeners(const Config& config, const Settings& weakest_first, Errors& errors) {
  for (const auto& [name, address] : {std::pair("listen", config.listen), {"health_listen", config.health_listen}}) {
    if (!config.keys.empty() || is_loopback(address.host)) continue;
    std::string where;
    for (const Setting& setting : weakest_first) where = setting.option->name == name ? setting.where : where;
    errors.push_back({where, "must be a loopback address (127.0.0.1, [::1]), got " + address.host +
                                 ": without keys everyone who reaches the port could use the daemon; see --keys"});
  }
}

void check_new_key(Command& command, Errors& errors) {
  if (!command.new_key) {
    if (command.scopes) errors.push_back({"--scopes", "is allowed only with --new-key"});
    return;
  }
  command.task = Task::new_key;
  if (!command.scopes) command.scopes = "jobs:read,jobs:write";
  if (!keys::is_name(*command.new_key)) {
    errors.push_back({"--new-key", "the name must be 1 to 64 of A-Z a-z 0-9 . _ -, got \"" + *command.new_key + '"'});
  }
  if (!keys::parse_scopes(*command.scopes)) {
    errors.push_back({"--scopes", "must be some of jobs:read,jobs:write,admin, got \"" + *command.scopes + '"'});
  }
  if (command.config.keys.empty()) errors.push_back({"--new-key", "needs --keys, the file to which the key is added"});
}

/// A connection URI or string of libpq, for people.
std::string without_password(const std::string& text) {
  static const std::regex of_user("(://[^@/?:]*:)[^@/?]*@"), word("password=('[^']*|[^ &]*)");
  return std::regex_replace(std::regex_replace(text, of_user, "$1***@"), word, "password=***");
}

}  // namespace

tracer::Result<Command, std::vector<ConfigError>> read_command(const std::vector<std::string>& words,
                                                               const Environment& environment,
                                                               const CheckConfig& check) {
  Arguments arguments;
  parse(words, arguments);
  Command command = arguments.command;
  if (command.task == Task::help || command.task == Task::version) return command;
  Errors errors = arguments.errors;
  Settings settings;  // weakest first
  if (command.config_file) read_config_file(*command.config_file, settings, errors);
  read_environment(environment, settings, command.unknown_variables);
  settings.insert(settings.end(), arguments.settings.begin(), arguments.settings.end());
  command.config = resolve(settings, errors);
  if (command.config.listen.port != 0 && command.config.listen == command.config.health_listen) {
    errors.push_back(
        {"health_listen", "must differ from listen, both are " + find_option("listen")->text(command.config)});
  }
  if (command.config.role != "all" && command.config.database.empty())
    errors.push_back({"role", "nodes with parts of their own need --database, which they share"});
  if (command.backup) command.task = Task::backup;
  if (command.backup == "") errors.push_back({"--backup", "needs the name of a new directory"});
  if (command.copy_to) command.task = Task::copy;
  const bool listens = command.task != Task::probe && command.task != Task::backup && command.task != Task::copy;
  if (listens) check_listeners(command.config, settings, errors);
  check_new_key(command, errors);
  if (check && (command.task == Task::run || command.task == Task::check)) {
    const Errors found = check(command.config);
    errors.insert(errors.end(), found.begin(), found.end());
  }
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
  CLI::App app("whittled renders JSON scenes that it receives over HTTP.", "whittled");
  Arguments arguments;
  define(app, arguments);
  return app.help();
}

std::vector<std::pair<std::string, std::string>> effective_settings(const Config& config) {
  std::vector<std::pair<std::string, std::string>> all;
  for (const Option& option : options()) all.emplace_back(option.name, without_password(option.text(config)));
  return all;
}

}  // namespace whittled
