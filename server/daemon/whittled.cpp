/// whittled: the daemon. This file is the architecture: it reads the configuration, builds from the leaves to the root,
/// serves until a signal, and stops in reverse.

#include <sys/resource.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include "api/asset_requests.h"
#include "api/load_assets.h"
#include "server/daemon/config.h"
#include "server/daemon/settings.h"
#include "server/http/access.h"
#include "server/http/handlers/routes.h"
#include "server/http/http_server.h"
#include "server/http/probe.h"
#include "server/keys/key_ring.h"
#include "server/queue/asset_collector.h"
#include "server/queue/disk_health.h"
#include "server/queue/queue.h"
#include "server/queue/queue_maintainer.h"
#include "server/storage/backup.h"
#include "server/storage/files/disk_space_monitor.h"
#include "server/storage/files/file_artifact_store.h"
#include "server/storage/files/file_asset_store.h"
#include "server/storage/sqlite/small_artifact_store.h"
#include "server/storage/sqlite/sqlite_delivery_store.h"
#include "server/storage/sqlite/sqlite_stores.h"
#include "server/telemetry/job_metrics.h"
#include "server/telemetry/json_log.h"
#include "server/telemetry/metric_registry.h"
#include "server/telemetry/queue_log.h"
#include "server/telemetry/request_metrics.h"
#include "server/telemetry/throughput_estimate.h"
#include "server/webhooks/webhooks.h"
#include "server/worker/protocol/asset_directory.h"
#include "server/worker/supervisor/supervisor.h"
#include "tracer/sha256.h"
#include "tracer/version.h"

namespace {

constexpr int exit_failed = 1, exit_bad_configuration = 2;
/// A result that finds no room is tried again for some seconds; the ballast is given up well before.
constexpr std::chrono::milliseconds disk_interval{500};

/// Signals as something to wait for. Made before any thread, which then all inherit the mask.
class Signals {
 public:
  Signals() {
    sigemptyset(&signals_);
    for (const int signal : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&signals_, signal);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
    fd_ = ::signalfd(-1, &signals_, SFD_CLOEXEC);
    if (fd_ < 0) throw std::system_error(errno, std::generic_category(), "signalfd");
  }
  Signals(const Signals&) = delete;
  ~Signals() { ::close(fd_); }

  /// Waits for SIGTERM or SIGINT, whose number it returns; SIGHUP calls `reload`. Afterwards the next one ends the
  /// process at once, as it would any other.
  int wait_for_stop(const std::function<void()>& reload) {
    signalfd_siginfo info{};
    for (;;) {
      if (::read(fd_, &info, sizeof info) < 0) continue;
      if (info.ssi_signo != SIGHUP) break;
      reload();
    }
    pthread_sigmask(SIG_UNBLOCK, &signals_, nullptr);
    return static_cast<int>(info.ssi_signo);
  }

 private:
  sigset_t signals_{};
  int fd_ = -1;
};

/// A connection is a descriptor; the usual soft limit of 1024 is there for programs that use select.
void raise_descriptor_limit() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  limit.rlim_cur = limit.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &limit);
}

/// The daemon never reads a file that a scene names, but says at once that it is not there.
std::vector<tracer::Issue> missing_files(const tracer::Scene& scene, const std::string& directory_path,
                                         queue::AssetStore& uploads) {
  if (scene.assets.empty()) return {};
  std::optional<worker::AssetDirectory> directory;
  if (!directory_path.empty()) directory.emplace(directory_path);
  return api::check_assets(scene, [&](const std::string& name) -> std::string {
    if (!name.starts_with(api::upload_prefix))
      return directory->refusal(name);  // without a directory none passed the reader
    const std::string sha256 = name.substr(api::upload_prefix.size());
    return uploads.use(sha256) ? "" : "was not uploaded; PUT /v1/assets/" + sha256 + " brings it";
  });
}

/// Throws when it cannot be opened: better told at the start than to each client.
void check_asset_directory(const whittled::Config& config) {
  if (!config.assets.empty()) (void)worker::AssetDirectory(config.assets);
}

void log_start(const telemetry::Log& log, const whittled::Command& command) {
  const auto settings = whittled::effective_settings(command.config);
  std::vector<telemetry::Field> fields{{"version", tracer::version()}, {"build", tracer::build()}};
  for (const auto& [name, value] : settings) fields.push_back({name, std::string_view(value)});
  log.write(telemetry::Level::info, "start", fields);
  for (const std::string& variable : command.unknown_variables) {
    log.write(telemetry::Level::warning, "unknown_environment_variable", {{"name", variable}});
  }
}

/// A line on stdout for scripts, which learn chosen ports from it.
void print_listen_address(const char* what, const std::string& host, int port) {
  const bool ipv6 = host.find(':') != std::string::npos;
  std::printf("%s on http://%s%s%s:%d\n", what, ipv6 ? "[" : "", host.c_str(), ipv6 ? "]" : "", port);
  std::fflush(stdout);
}

/// What holds stays when the file is wrong: a slip of the pen locks nobody out.
void reload_keys(const std::string& path, keys::KeyRing& ring, const telemetry::Log& log) {
  auto read = keys::read(path);
  if (read) {
    ring.reload(std::move(*read));
    log.write(telemetry::Level::info, "keys_reloaded", {{"count", static_cast<std::int64_t>(ring.size())}});
    return;
  }
  for (const std::string& mistake : read.error()) {
    log.write(telemetry::Level::error, "key_reload_failed", {{"detail", std::string_view(mistake)}});
  }
}

/// From what ended before this start.
void seed_throughput_estimate(queue::JobStore& jobs, telemetry::ThroughputEstimate& pace) {
  queue::JobFilter filter;
  filter.state = queue::JobState::succeeded;
  queue::JobPage page = jobs.list(filter, {}, telemetry::ThroughputEstimate::renders_max);
  std::reverse(page.items.begin(), page.items.end());
  for (const queue::Job& job : page.items) pace.learn(job.report);
}

/// `ring`: null where there are no keys. False when it had to end because the disk is broken.
bool serve(const whittled::Config& config, keys::KeyRing* ring, const telemetry::Log& log) {
  Signals signals;
  raise_descriptor_limit();
  check_asset_directory(config);

  const queue::Log queue_log = telemetry::queue_log(log);
  storage::files::DiskSpaceMonitor disk(config.data, {.reserve_bytes = config.disk_free_bytes}, queue_log);
  std::atomic<bool> disk_io_error = false;
  queue::DiskHealth disk_health([&](const std::string& what) {
    log.write(telemetry::Level::error, "disk_io_error", {{"detail", std::string_view(what)}});
    disk_io_error = true;
    ::kill(::getpid(), SIGTERM);  // as anyone would who stops a daemon: the signal is waited for below
  });
  const storage::sqlite::SqliteStores sqlite_stores(config.data, {.health = &disk_health});
  const queue::Stores stores = sqlite_stores.all();
  storage::files::FileArtifactStore large_artifacts(config.data, &disk_health);
  storage::sqlite::SmallArtifactStore artifacts(sqlite_stores, large_artifacts);
  const std::string uploads_directory = config.data + "/uploads";
  storage::files::FileAssetStore uploads(uploads_directory, queue::system_clock(), config.uploads_bytes, &disk_health);
  queue::IdSource ids(queue::system_clock(), queue::system_random());
  const auto disk_space = [&disk] { return disk.now(); };
  queue::Queue queue(stores, artifacts, ids, queue::system_clock(), queue_log,
                     {.queued_limit = static_cast<std::int64_t>(config.queued_jobs),
                      .owner_queued_limit = static_cast<std::int64_t>(config.key_queued_jobs),
                      .owner_artifact_bytes_limit = static_cast<std::int64_t>(config.key_artifact_bytes),
                      .disk_space = disk_space});
  queue::Events events(http::event_text, queue::system_clock(), {.listeners_max = config.streams});
  telemetry::Metrics metrics(telemetry::all_families());
  telemetry::ThroughputEstimate pace;
  seed_throughput_estimate(stores.jobs, pace);
  telemetry::JobMetrics job_metrics(
      metrics, pace, [&stores](const std::string& id) { return stores.jobs.find(id); }, events);
  queue.notifications.observe(&job_metrics);
  const queue::PeriodicTask disk_task("measure_disk_space", queue_log, [&] {
    if (disk.measure()) queue.lifecycle.on_disk_space_available();
    return disk_interval;
  });
  const queue::QueueMaintainer maintainer(queue.lifecycle, queue_log);
  const queue::LeaseRenewer lease_renewer(queue.lifecycle, queue_log);

  const api::Limits limits = document_limits(config);
  const std::chrono::days asset_age(static_cast<int>(config.asset_days));
  const queue::AssetCollector collector(uploads, stores.maintenance, queue::system_clock(), queue_log,
                                        {.age = asset_age});

  storage::sqlite::SqliteDeliveryStore deliveries(config.data, &disk_health);
  const webhooks::WebhookSender webhook_sender(sender_settings(config));
  std::optional<webhooks::Webhooks> webhooks;
  if (limits.webhooks) {
    const auto find = [&queue](const std::string& id) { return queue.queries.find(id); };
    const auto send = [&webhook_sender](const auto&... arguments) { return webhook_sender.post(arguments...); };
    webhooks.emplace(deliveries, find, send, queue::system_clock(), ids, queue_log, webhook_settings(config));
    queue.notifications.set_completion_listener(&*webhooks);
  }

  worker::SupervisorSettings worker_settings;
  worker_settings.executable = worker::default_executable();
  worker_settings.slots = static_cast<int>(config.jobs);
  worker_settings.files = {config.assets, uploads_directory, config.objects, config.triangles};
  worker_settings.wall_time = std::chrono::seconds(config.wall_time_s);
  worker_settings.job_memory_bytes = config.job_memory_bytes;
  worker_settings.threads = static_cast<int>(config.threads);
  worker_settings.scene_cache_bytes = config.scene_cache_bytes;
  worker::Supervisor supervisor(queue, worker_settings, queue_log);

  const std::string spool_directory = config.data + "/spool";
  std::filesystem::create_directories(spool_directory);
  std::atomic<bool> draining = false;
  http::HttpServerSettings settings = gate_settings(config, spool_directory, ring);
  settings.on_response = [&metrics](std::string_view method, std::string_view route, int status, double seconds) {
    telemetry::count_request(metrics, method, route, status, seconds);
  };
  const http::ApiContext front{
      .queue = queue,
      .events = events,
      .assets = uploads,
      .clock = queue::system_clock(),
      .limits = limits,
      .batch_limits = {limits, static_cast<int>(config.batch_jobs), config.batch_bytes},
      .missing_files = [&](const tracer::Scene& scene) { return missing_files(scene, config.assets, uploads); },
      .sha256 = tracer::sha256_hex,
      .deliveries = [&deliveries](const std::string& id) { return deliveries.of_job(id); },
      .room = disk_space,
      .job_memory_bytes = config.job_memory_bytes,
      .render_wait = std::chrono::seconds(config.render_wait_s),
      .draining = [&draining] { return draining.load(); },
      .seconds_per_work = [&pace] { return pace.seconds_per_work(); },
      .effective_limits = effective_limits(config, limits, settings.head),
      .sandbox = [&supervisor] { return supervisor.sandbox(); },
      .keys = ring};
  const auto request_id = [&ids] { return ids.next(); };
  http::HttpServer gate(settings, http::client_routes(front), request_id, log);
  const http::Health health{
      .not_ready = [&queue] { return queue.queries.not_ready(); },
      .draining = [&draining] { return draining.load(); },
      .job_count = [&stores](queue::JobState state) { return stores.statistics.count(state); },
      .event_listeners = [&events] { return events.listeners(); },
      .connections = [&gate] { return gate.connections(); },
      .worker_pid = [&supervisor] { return supervisor.worker_pid(); },
      .kept_bytes =
          [&supervisor] {
            return http::KeptBytes{supervisor.cache_bytes().geometry, supervisor.cache_bytes().images};
          },
      .oldest_at = [&stores] { return stores.statistics.depth().oldest_at; },
      .room = disk_space,
      .upload_bytes = [&uploads] { return uploads.bytes(); },
      .clock = queue::system_clock(),
      .figures = [&metrics] { return metrics.text(); }};
  http::HttpServer health_gate(health_gate_settings(config, spool_directory), http::health_routes(health), request_id,
                               log);

  log.write(telemetry::Level::info, "listening",
            {{"port", std::int64_t{gate.port()}}, {"health_port", std::int64_t{health_gate.port()}}});
  print_listen_address("listening", config.listen.host, gate.port());
  print_listen_address("health", config.health_listen.host, health_gate.port());

  const int signal = signals.wait_for_stop([&] {
    if (ring != nullptr) reload_keys(config.keys, *ring, log);
  });
  log.write(telemetry::Level::info, "draining", {{"signal", std::int64_t{signal}}});
  draining = true;  // new work is refused, reads go on
  // Waiting requests get their answers. Nothing more can be kept on a broken disk: the next start sees what it has.
  const bool finished = supervisor.drain(std::chrono::seconds(disk_io_error ? 0 : config.drain_s));
  gate.drain(std::chrono::seconds(10));  // the others too
  health_gate.drain(std::chrono::seconds(1));
  log.write(telemetry::Level::info, "stopped", {{"all_jobs_finished", finished}});
  return !disk_io_error;
}

int run(const whittled::Command& command, keys::KeyRing* ring) {
  const telemetry::Log log(*telemetry::level_named(command.config.log_level));
  log_start(log, command);
  try {
    return serve(command.config, ring, log) ? 0 : exit_failed;
  } catch (const std::exception& exception) {
    log.write(telemetry::Level::error, "startup_failed", {{"detail", std::string_view(exception.what())}});
    return exit_failed;
  }
}

void print_settings(const whittled::Command& command) {
  for (const auto& [name, value] : whittled::effective_settings(command.config)) {
    std::printf("%s = %s\n", name.c_str(), value.c_str());
  }
  for (const std::string& variable : command.unknown_variables) {
    std::fprintf(stderr, "whittled: %s: is no option; it is ignored\n", variable.c_str());
  }
}

/// The key itself goes to stdout, or to stderr where stdout takes the file's line, and nowhere else.
int make_key(const whittled::Command& command) {
  try {
    const keys::CreatedKey created = keys::create(command.key_name, *keys::parse_scopes(command.key_scopes));
    const bool to_stdout = command.config.keys == "-";
    if (!to_stdout) keys::append(command.config.keys, created.line);
    std::printf("%s\n", to_stdout ? created.line.c_str() : created.token.c_str());
    if (to_stdout) std::fprintf(stderr, "%s\n", created.token.c_str());
    std::fprintf(stderr, "whittled: this is the only time the key is shown; a running daemon learns of it by SIGHUP\n");
    return 0;
  } catch (const std::exception& exception) {
    std::fprintf(stderr, "whittled: --keys: %s\n", exception.what());
    return exit_failed;
  }
}

int probe_readiness(const whittled::Config& config) {
  const http::Probe found = http::probe(config.health_listen.host, config.health_listen.port);
  std::printf("%s\n", found.answer.c_str());
  return found.ready ? 0 : exit_failed;
}

int write_backup(const whittled::Command& command) {
  try {
    storage::back_up(command.config.data, command.backup_directory);
    return 0;
  } catch (const std::exception& exception) {
    std::fprintf(stderr, "whittled: --backup: %s\n", exception.what());
    return exit_failed;
  }
}

int tell(const std::vector<whittled::ConfigError>& errors) {
  for (const auto& [where, sentence] : errors) {
    std::fprintf(stderr, "whittled: %s: %s\n", where.c_str(), sentence.c_str());
  }
  return exit_bad_configuration;
}

/// For tasks that need all of the configuration to be right, and the files that it names.
int check_and_run(const whittled::Command& command) {
  std::vector<whittled::ConfigError> errors = validate_webhooks(command.config);
  std::optional<keys::KeyRing> ring;
  if (!command.config.keys.empty()) {
    auto read = keys::read(command.config.keys);
    if (read) {
      ring.emplace(std::move(*read));
    } else {
      for (const std::string& mistake : read.error()) errors.push_back({"--keys", mistake});
    }
  }
  if (!errors.empty()) return tell(errors);
  if (command.task == whittled::Task::run) return run(command, ring ? &*ring : nullptr);
  print_settings(command);
  return 0;
}

}  // namespace

int main(int argument_count, char** arguments) {
  const auto command =
      whittled::read_command({arguments + 1, arguments + argument_count}, whittled::process_environment());
  if (!command) return tell(command.error());
  switch (command->task) {
    case whittled::Task::help:
      std::fputs(whittled::help_text().c_str(), stdout);
      return 0;
    case whittled::Task::version:
      std::printf("whittled %s\n", std::string(tracer::build()).c_str());
      return 0;
    case whittled::Task::new_key:
      return make_key(*command);
    case whittled::Task::probe:
      return probe_readiness(command->config);
    case whittled::Task::backup:
      return write_backup(*command);
    case whittled::Task::check:
    case whittled::Task::run:
      return check_and_run(*command);
  }
  return exit_failed;
}
