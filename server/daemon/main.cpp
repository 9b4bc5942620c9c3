/// whittled: the daemon. Reads the configuration, builds the layers from the leaves to the root, serves until a signal,
/// and stops in reverse order.

#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <exception>
#include <functional>
#include <optional>
#include <string_view>
#include <thread>

#include "server/daemon/config.h"
#include "server/daemon/copy_data.h"
#include "server/daemon/wiring.h"
#include "server/http/handlers/routes.h"
#include "server/storage/backup.h"
#include "server/telemetry/json_log.h"
#include "tracer/version.h"

namespace whittled {
namespace {

constexpr int exit_failed = 1, exit_bad_configuration = 2;

/// Blocks SIGTERM, SIGINT and SIGHUP and waits for them. Created before any thread, because threads inherit the mask.
class StopSignals {
 public:
  StopSignals() {
    sigemptyset(&signals_);
    for (const int signal : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&signals_, signal);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
  }

  /// Returns SIGTERM or SIGINT; calls `reload` for SIGHUP. Afterwards a further signal ends the process at once.
  int wait(const std::function<void()>& reload) {
    int signal = 0;
    while (sigwait(&signals_, &signal) == 0 && signal == SIGHUP) reload();
    pthread_sigmask(SIG_UNBLOCK, &signals_, nullptr);
    return signal;
  }

 private:
  sigset_t signals_{};
};

/// Each connection is a descriptor. The usual soft limit of 1024 exists for programs that use select().
void raise_descriptor_limit() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

void log_start(const telemetry::Log& log, const Command& command) {
  const auto settings = effective_settings(command.config);
  std::vector<telemetry::Field> fields{{"version", tracer::version()}, {"build", tracer::build()}};
  for (const auto& [name, value] : settings) fields.push_back({name, std::string_view(value)});
  log.write(telemetry::Level::info, "starting", fields);
  for (const std::string& variable : command.unknown_variables) {
    log.write(telemetry::Level::warning, "unknown_environment_variable", {{"name", variable}});
  }
}

/// If the file does not parse, the current keys stay in force.
void reload_keys(const std::string& path, keys::KeyRing& ring, const telemetry::Log& log) {
  auto keys = keys::read(path);
  if (keys) {
    ring.reload(*std::move(keys));
    log.write(telemetry::Level::info, "keys_reloaded", {{"count", static_cast<std::int64_t>(ring.size())}});
    return;
  }
  for (const std::string& error : keys.error()) {
    log.write(telemetry::Level::error, "key_reload_failed", {{"detail", std::string_view(error)}});
  }
}

/// `port` is 0 without a client listener. Scripts read the ports from standard output.
void print_addresses(const Config& config, std::uint16_t port, std::uint16_t health_port, const telemetry::Log& log) {
  log.write(telemetry::Level::info, "listening",
            {{"port", std::int64_t{port}}, {"health_port", std::int64_t{health_port}}});
  if (port != 0) std::printf("{\"listening\":\"http://%s\"}\n", to_text({config.listen.host, port}).c_str());
  std::printf("{\"health\":\"http://%s\"}\n", to_text({config.health_listen.host, health_port}).c_str());
  std::fflush(stdout);
}

/// Serves until a signal. `keys`: null if none are needed. Returns false if the disk failed.
bool serve(const Config& config, const Credentials& credentials, keys::KeyRing* keys, const telemetry::Log& log) {
  StopSignals signals;
  raise_descriptor_limit();
  const queue::Log event_log = telemetry::queue_log(log);
  std::atomic<bool> disk_failed = false, draining = false;

  Storage storage(config, event_log, [&](const std::string& what) {
    log.write(telemetry::Level::error, "disk_io_error", {{"detail", std::string_view(what)}});
    disk_failed = true;
    ::kill(::getpid(), SIGTERM);  // starts a graceful shutdown
  });
  JobQueue jobs(config, storage, event_log);
  const Maintenance maintenance(config, storage, jobs, event_log);
  const auto webhooks = start_webhooks(credentials, storage, jobs, event_log);
  worker::Supervisor supervisor(jobs.queue, supervisor_settings(config, storage), event_log);
  const queue::Node node = own_node(config, storage, jobs);
  join_nodes(config, node, jobs, supervisor);

  const std::jthread history = queue::repeat("record_history", event_log, [&] {
    const telemetry::GaugeValues now = gauge_values(storage, jobs, supervisor, 0);
    jobs.job_metrics.history().close_step(queue::system_clock()(), now.jobs[0].second, now.jobs[1].second,
                                          now.rss_bytes.value_or(0) + now.worker_rss_bytes.value_or(0));
    return std::chrono::milliseconds(telemetry::ServiceHistory::step_ms);
  });

  telemetry::RequestMetrics request_metrics(jobs.registry);
  const auto new_request_id = [&jobs] { return jobs.ids.next(); };
  http::Readiness readiness([&jobs] { return jobs.queue.queries.not_ready(); }, draining);
  std::optional<http::HttpServer> api;
  if (config.role != "worker") {
    api.emplace(
        api_server_settings(config, storage, keys, request_metrics),
        http::client_routes(api_context(config, storage, jobs, supervisor, webhooks.get(), keys, readiness, node)),
        new_request_id, log);
  }
  const auto metrics = [&] {
    const std::size_t connections = api ? api->connections() : 0;
    return telemetry::metrics_text(jobs.registry, gauge_values(storage, jobs, supervisor, connections));
  };
  http::HttpServer health(health_server_settings(config, storage), http::health_routes(readiness, metrics),
                          new_request_id, log);
  print_addresses(config, api ? api->port() : 0, health.port(), log);

  const int signal = signals.wait([&] {
    if (keys == nullptr) return;
    reload_keys(config.keys, *keys, log);
    if (api) api->check_access();
  });
  log.write(telemetry::Level::info, "draining", {{"signal", std::int64_t{signal}}});
  draining = true;  // refuses new work; reads continue
  // After a disk failure no result can be stored; the next start continues from the content of the disk.
  const bool finished = supervisor.drain(std::chrono::seconds(disk_failed ? 0 : config.drain_s));
  if (api) api->drain(std::chrono::seconds(10));
  if (jobs.link) jobs.link->leave();
  health.drain(std::chrono::seconds(1));
  log.write(telemetry::Level::info, "stopped", {{"all_jobs_finished", finished}});
  return !disk_failed;
}

int run(const Command& command, const Credentials& credentials) {
  const telemetry::Log log(*telemetry::level_named(command.config.log_level));
  log_start(log, command);
  std::optional<keys::KeyRing> keys;
  if (credentials.keys) keys.emplace(*credentials.keys);
  try {
    return serve(command.config, credentials, keys ? &*keys : nullptr, log) ? 0 : exit_failed;
  } catch (const std::exception& exception) {
    log.write(telemetry::Level::error, "startup_failed", {{"detail", std::string_view(exception.what())}});
    return exit_failed;
  }
}

void print_settings(const Command& command) {
  for (const auto& [name, value] : effective_settings(command.config)) {
    std::printf("%s = %s\n", name.c_str(), value.c_str());
  }
  for (const std::string& variable : command.unknown_variables) {
    std::fprintf(stderr, "whittled: %s: is no option; it is ignored\n", variable.c_str());
  }
}

/// Prints the key to stdout, or to stderr if stdout is the file of keys.
void create_key(const Command& command) {
  const keys::CreatedKey created = keys::create(*command.new_key, *keys::parse_scopes(*command.scopes));
  const bool to_stdout = command.config.keys == "-";
  if (!to_stdout) keys::append(command.config.keys, created.line);
  std::printf("%s\n", to_stdout ? created.line.c_str() : created.token.c_str());
  if (to_stdout) std::fprintf(stderr, "%s\n", created.token.c_str());
  std::fprintf(stderr, "whittled: the key is not shown again; send SIGHUP to a running daemon to load it\n");
}

int probe_readiness(const Config& config) {
  const http::Probe probe = http::probe(config.health_listen.host, config.health_listen.port);
  std::fprintf(stderr, "whittled: %s: %s\n", to_text(config.health_listen).c_str(), probe.answer.c_str());
  return probe.ready ? 0 : exit_failed;
}

int print_errors(const std::vector<ConfigError>& errors) {
  for (const auto& [where, sentence] : errors) {
    std::fprintf(stderr, "whittled: %s: %s\n", where.c_str(), sentence.c_str());
  }
  return exit_bad_configuration;
}

/// Calls `task`, which may throw; `flag` names it in the error.
int run_task(const char* flag, const std::function<void()>& task) {
  try {
    task();
    return 0;
  } catch (const std::exception& exception) {
    std::fprintf(stderr, "whittled: %s: %s\n", flag, exception.what());
    return exit_failed;
  }
}

/// For the tasks that need the files which the configuration names.
int check_and_run(const Command& command) {
  const auto credentials = read_credentials(command.config);
  if (!credentials) return print_errors(credentials.error());
  if (command.task == Task::run) return run(command, *credentials);
  print_settings(command);
  for (const auto& [where, sentence] : find_conflicts(command.config)) {
    std::fprintf(stderr, "whittled: warning: %s: %s\n", where.c_str(), sentence.c_str());
  }
  return 0;
}

int run_command(const Command& command) {
  switch (command.task) {
    case Task::help:
      std::fputs(help_text().c_str(), stdout);
      return 0;
    case Task::version:
      std::printf("whittled %s\n", std::string(tracer::build()).c_str());
      return 0;
    case Task::new_key:
      return run_task("--keys", [&] { create_key(command); });
    case Task::probe:
      return probe_readiness(command.config);
    case Task::backup:
      if (!command.config.database.empty())
        return print_errors({{"--backup", "copies a data directory; pg_dump copies the database of --database"}});
      return run_task("--backup", [&] { storage::back_up(command.config.data, *command.backup); });
    case Task::copy:
      if (const auto errors = find_copy_errors(command.config, *command.copy_to); !errors.empty())
        return print_errors(errors);
      return run_task("--copy-to", [&] { copy_data(command.config, *command.copy_to); });
    case Task::check:
    case Task::run:
      return check_and_run(command);
  }
  return exit_failed;
}

}  // namespace
}  // namespace whittled

int main(int argument_count, char** arguments) {
  ::umask(027);  // also files that libraries create, such as the database, are not for every user
  const auto command = whittled::read_command({arguments + 1, arguments + argument_count},
                                              whittled::process_environment(), whittled::find_start_errors);
  return command ? whittled::run_command(*command) : whittled::print_errors(command.error());
}
