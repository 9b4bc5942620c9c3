/// whittled: the daemon. This file is the architecture: it reads the configuration, builds from the leaves to the root,
/// serves until a signal, and stops in reverse.

#include <sys/resource.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <system_error>

#include "api/load_assets.h"
#include "server/config/config.h"
#include "server/http/gate.h"
#include "server/http/routes.h"
#include "server/jobs/housekeeper.h"
#include "server/jobs/queue.h"
#include "server/storage/files/file_artifact_store.h"
#include "server/storage/files/sha256.h"
#include "server/storage/sqlite/sqlite_job_store.h"
#include "server/telemetry/log.h"
#include "server/telemetry/queue_log.h"
#include "server/worker/asset_folder.h"
#include "server/worker/supervisor.h"
#include "tracer/version.h"

namespace {

constexpr int exit_failed = 1, exit_bad_configuration = 2;

/// SIGTERM and SIGINT as something to wait for. Made before any thread, which then all inherit the mask.
class StopSignals {
 public:
  StopSignals() {
    sigemptyset(&signals_);
    sigaddset(&signals_, SIGTERM);
    sigaddset(&signals_, SIGINT);
    pthread_sigmask(SIG_BLOCK, &signals_, nullptr);
    fd_ = ::signalfd(-1, &signals_, SFD_CLOEXEC);
    if (fd_ < 0) throw std::system_error(errno, std::generic_category(), "signalfd");
  }
  StopSignals(const StopSignals&) = delete;
  ~StopSignals() { ::close(fd_); }

  /// Its number. Afterwards the next one ends the process at once, as it would any other.
  int wait() {
    signalfd_siginfo info{};
    while (::read(fd_, &info, sizeof info) < 0 && errno == EINTR) {
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

api::Limits document_limits(const config::Config& config) {
  api::Limits limits;
  limits.document.bytes = config.body_bytes;
  limits.scene.pixels = config.pixels;
  limits.scene.samples_times_pixels = config.samples_times_pixels;
  limits.scene.objects = config.objects;
  limits.scene.triangles = config.triangles;
  limits.scene.lights = static_cast<std::uint32_t>(config.lights);
  if (!config.assets.empty()) limits.files = api::Files::below_a_folder;
  return limits;
}

/// The daemon never reads a file that a scene names, but says at once that it is not there.
std::vector<tracer::Issue> missing_files(const tracer::Scene& scene, const std::string& folder_path) {
  if (scene.assets.empty()) return {};
  const worker::AssetFolder folder(folder_path);
  return api::check_assets(scene, [&](const std::string& name) { return folder.refusal(name); });
}

/// Throws when it cannot be opened: better told at the start than to each client.
void check_asset_folder(const config::Config& config) {
  if (!config.assets.empty()) (void)worker::AssetFolder(config.assets);
}

http::GateSettings gate_settings(const config::Config& config, const std::string& spool_folder) {
  http::GateSettings settings;
  settings.host = config.listen.host;
  settings.port = config.listen.port;
  settings.connections_max = config.connections;
  settings.connections_per_address_max = config.connections_per_address;
  settings.handler_threads = config.handler_threads;
  settings.head.body_bytes = config.body_bytes;
  settings.spool_folder = spool_folder;
  return settings;
}

/// One thread suffices for three short routes, and a probe needs no body.
http::GateSettings health_gate_settings(const config::Config& config, const std::string& spool_folder) {
  http::GateSettings settings;
  settings.host = config.health_listen.host;
  settings.port = config.health_listen.port;
  settings.connections_max = settings.connections_per_address_max = 256;
  settings.handler_threads = 1;
  settings.waiting_max = 64;
  settings.head.body_bytes = 0;
  settings.spool_folder = spool_folder;
  return settings;
}

/// Everything that GET /v1/version tells as a limit.
std::vector<std::pair<std::string, std::uint64_t>> told_limits(const config::Config& config, const api::Limits& limits,
                                                               const http::HeadLimits& head) {
  return {{"body_bytes", config.body_bytes},
          {"json_depth", limits.document.depth},
          {"json_values", limits.document.values},
          {"json_string_bytes", limits.document.string_bytes},
          {"json_key_bytes", limits.document.key_bytes},
          {"json_number_chars", limits.document.number_chars},
          {"name_bytes", limits.document.name_bytes},
          {"labels", limits.document.labels},
          {"pixels", limits.scene.pixels},
          {"image_side", limits.scene.image_side},
          {"samples_times_pixels", limits.scene.samples_times_pixels},
          {"max_depth", limits.scene.max_depth},
          {"objects", limits.scene.objects},
          {"triangles", limits.scene.triangles},
          {"lights", limits.scene.lights},
          {"materials", limits.scene.materials},
          {"textures", limits.scene.textures},
          {"queued_jobs", config.queued_jobs},
          {"batch_jobs", config.batch_jobs},
          {"batch_bytes", config.batch_bytes},
          {"key_queued_jobs", config.key_queued_jobs},
          {"key_artifact_bytes", config.key_artifact_bytes},
          {"wall_time_s", config.wall_time_s},
          {"job_memory_bytes", config.job_memory_bytes},
          {"connections", config.connections},
          {"connections_per_address", config.connections_per_address},
          {"render_wait_s", config.render_wait_s},
          {"request_line_bytes", head.request_line_bytes},
          {"target_bytes", head.target_bytes},
          {"header_count", head.header_count},
          {"header_bytes", head.header_bytes}};
}

void log_start(const telemetry::Log& log, const config::Command& command) {
  const auto settings = config::settings(command.config);
  std::vector<telemetry::Field> fields{{"version", tracer::version()}, {"build", tracer::build()}};
  for (const auto& [name, value] : settings) fields.push_back({name, std::string_view(value)});
  log.write(telemetry::Level::info, "start", fields);
  for (const std::string& variable : command.ignored_variables) {
    log.write(telemetry::Level::warning, "ignored_variable", {{"name", variable}});
  }
}

/// A line on stdout for scripts, which learn chosen ports from it.
void tell_address(const char* what, const std::string& host, int port) {
  const bool ipv6 = host.find(':') != std::string::npos;
  std::printf("%s on http://%s%s%s:%d\n", what, ipv6 ? "[" : "", host.c_str(), ipv6 ? "]" : "", port);
  std::fflush(stdout);
}

void serve(const config::Config& config, const telemetry::Log& log) {
  StopSignals stop_signals;
  raise_descriptor_limit();
  check_asset_folder(config);

  jobs::SqliteJobStore store(config.data);
  jobs::FileArtifactStore artifacts(config.data);
  jobs::IdSource ids(jobs::system_clock(), jobs::system_random());
  const jobs::Log queue_log = telemetry::queue_log(log);
  jobs::Queue queue(store, artifacts, ids, jobs::system_clock(), queue_log,
                    {.queued_limit = static_cast<std::int64_t>(config.queued_jobs),
                     .owner_queued_limit = static_cast<std::int64_t>(config.key_queued_jobs),
                     .owner_artifact_bytes_limit = static_cast<std::int64_t>(config.key_artifact_bytes)});
  const jobs::Housekeeper housekeeper(queue, queue_log);

  worker::SupervisorSettings worker_settings;
  worker_settings.executable = worker::worker_beside_this_program();
  worker_settings.slots = static_cast<int>(config.jobs);
  worker_settings.files = {config.assets, config.objects, config.triangles};
  worker_settings.wall_time = std::chrono::seconds(config.wall_time_s);
  worker_settings.job_memory_bytes = config.job_memory_bytes;
  worker::Supervisor supervisor(queue, worker_settings, queue_log);

  const std::string spool_folder = config.data + "/spool";
  std::filesystem::create_directories(spool_folder);
  std::atomic<bool> draining = false;
  const http::GateSettings settings = gate_settings(config, spool_folder);
  const api::Limits limits = document_limits(config);
  const http::Front front{
      .jobs = queue,
      .clock = jobs::system_clock(),
      .limits = limits,
      .batch_limits = {limits, static_cast<int>(config.batch_jobs), config.batch_bytes},
      .missing_files = [&config](const tracer::Scene& scene) { return missing_files(scene, config.assets); },
      .sha256 = jobs::sha256_of,
      .job_memory_bytes = config.job_memory_bytes,
      .render_wait = std::chrono::seconds(config.render_wait_s),
      .draining = [&draining] { return draining.load(); },
      .told_limits = told_limits(config, limits, settings.head)};
  const http::Health health{.not_ready = [&] { return draining ? std::string("draining") : queue.not_ready(); },
                            .job_count = [&store](jobs::JobState state) { return store.count(state); }};
  const auto request_id = [&ids] { return ids.next(); };
  http::Gate health_gate(health_gate_settings(config, spool_folder), http::health_routes(health), request_id, log);
  http::Gate gate(settings, http::client_routes(front), request_id, log);

  log.write(telemetry::Level::info, "listening",
            {{"port", std::int64_t{gate.port()}}, {"health_port", std::int64_t{health_gate.port()}}});
  tell_address("listening", config.listen.host, gate.port());
  tell_address("health", config.health_listen.host, health_gate.port());

  const int signal = stop_signals.wait();
  log.write(telemetry::Level::info, "draining", {{"signal", std::int64_t{signal}}});
  draining = true;                                                               // new work is refused, reads go on
  const bool finished = supervisor.drain(std::chrono::seconds(config.drain_s));  // waiting requests get their answers
  gate.drain(std::chrono::seconds(10));                                          // the others too
  health_gate.drain(std::chrono::seconds(1));
  log.write(telemetry::Level::info, "stopped", {{"all_jobs_finished", finished}});
}

int run(const config::Command& command) {
  const telemetry::Log log(*telemetry::level_named(command.config.log_level));
  log_start(log, command);
  try {
    serve(command.config, log);
    return 0;
  } catch (const std::exception& exception) {
    log.write(telemetry::Level::error, "cannot_run", {{"detail", std::string_view(exception.what())}});
    return exit_failed;
  }
}

void print_settings(const config::Command& command) {
  for (const auto& [name, value] : config::settings(command.config)) {
    std::printf("%s = %s\n", name.c_str(), value.c_str());
  }
  for (const std::string& variable : command.ignored_variables) {
    std::fprintf(stderr, "whittled: %s: is no option; it is ignored\n", variable.c_str());
  }
}

}  // namespace

int main(int argument_count, char** arguments) {
  const auto command = config::read_command({arguments + 1, arguments + argument_count}, config::process_environment());
  if (!command) {
    for (const auto& [where, sentence] : command.error()) {
      std::fprintf(stderr, "whittled: %s: %s\n", where.c_str(), sentence.c_str());
    }
    return exit_bad_configuration;
  }
  switch (command->task) {
    case config::Task::help:
      std::fputs(config::help_text().c_str(), stdout);
      return 0;
    case config::Task::version:
      std::printf("whittled %s\n", std::string(tracer::build()).c_str());
      return 0;
    case config::Task::check:
      print_settings(*command);
      return 0;
    case config::Task::run:
      return run(*command);
  }
  return exit_failed;
}
