#pragma once
/// Configuration of the daemon: one immutable value, read completely at the start, then handed out in parts.
///
/// Every option has one name. `--render-wait-s 30` overrides `WHITTLE_RENDER_WAIT_S=30`, which overrides the line
/// `render_wait_s = 30` of the file given by `--config`. The errors of all three are reported together, with their
/// places.

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "tracer/result.h"

namespace whittled {

struct Address {
  std::string host;  ///< a literal address, IPv6 without brackets; loopback unless there are keys
  std::uint16_t port = 0;
  bool operator==(const Address&) const = default;
};
std::string to_text(const Address& address);  ///< "127.0.0.1:8080", "[::1]:8080"

/// Defaults, ranges and their reasons are in option_table.cpp and are printed by `--help`.
struct Config {
  Address listen, health_listen;
  std::string data;
  std::string role;       ///< all, api or worker
  std::string database;   ///< empty: SQLite in the data directory
  std::string artifacts;  ///< s3://BUCKET/PREFIX or a directory; empty: in the data directory
  std::string s3_endpoint, s3_region, s3_path_style, s3_credentials_file, artifact_redirect;
  std::string assets, keys;                           ///< a directory and a file; empty: none
  std::string webhook_secret_file, webhook_networks;  ///< empty: none
  std::string log_level, dashboard;
  std::uint64_t asset_bytes = 0, asset_days = 0, uploads_bytes = 0, spool_bytes = 0, disk_free_bytes = 0;
  std::uint64_t asset_cache_bytes = 0, waiting_bytes = 0;
  std::uint64_t jobs = 0, threads = 0, scene_cache_bytes = 0;
  std::uint64_t body_bytes = 0, pixels = 0, samples_times_pixels = 0, objects = 0, triangles = 0, lights = 0;
  std::uint64_t queued_jobs = 0, key_queued_jobs = 0, key_running_jobs = 0, key_artifact_bytes = 0;
  std::uint64_t batch_jobs = 0, batch_bytes = 0, batch_values = 0;
  std::uint64_t job_days = 0, failed_job_days = 0, artifact_bytes = 0;
  std::uint64_t wall_time_s = 0, job_memory_bytes = 0;
  std::uint64_t connections = 0, connections_per_address = 0, streams = 0, handler_threads = 0;
  std::uint64_t render_wait_s = 0, drain_s = 0, lease_s = 0;
};

struct ConfigError {
  std::string where;  ///< "--jobs", "WHITTLE_JOBS" or "whittle.conf:7"
  std::string sentence;
  bool operator==(const ConfigError&) const = default;
};

enum class Task { run, check, help, version, new_key, probe, backup, copy };

struct Command {
  Task task = Task::run;
  /// Values of the flags of these names; with `new_key` there are scopes.
  std::optional<std::string> config_file, new_key, scopes, backup, copy_to;
  Config config;
  /// WHITTLE_ variables that are not options. They are no error: Kubernetes sets WHITTLE_PORT and others in every pod
  /// beside a service named whittle.
  std::vector<std::string> unknown_variables;
};

using Environment = std::vector<std::pair<std::string, std::string>>;  ///< name, value

/// Errors of what a configuration names; their places are flags.
using CheckConfig = std::function<std::vector<ConfigError>(const Config&)>;

/// `arguments` without the program's name. Reads the file that `--config` names and nothing else. `--help` and
/// `--version` are valid whatever the rest is. The errors of `check` are added if the daemon is to start, or its
/// configuration to be checked; options with errors have their default then.
tracer::Result<Command, std::vector<ConfigError>> read_command(const std::vector<std::string>& arguments,
                                                               const Environment& environment,
                                                               const CheckConfig& check = {});

/// The variables of this process that start with WHITTLE_.
Environment process_environment();

/// Every option with its default, range and reason.
std::string help_text();

/// Name and effective value of every option, for the log and `--check-config`. No value is a secret.
std::vector<std::pair<std::string, std::string>> effective_settings(const Config& config);

/// A row of the one table of options.
struct Option {
  std::string_view name, default_text;
  std::variant<std::uint64_t Config::*, std::string Config::*, Address Config::*> member;
  /// The meaning of a text, or all its allowed values separated by '|'. The text may be empty if its default is.
  std::string_view values;
  std::uint64_t least, most;  ///< range of a number
  std::string_view help;      ///< the effect, and the reason of the default
  bool is_limit = false;      ///< it is a number among the limits of GET /v1/version

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
