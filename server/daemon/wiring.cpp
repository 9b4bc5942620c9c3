#include "server/daemon/wiring.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <climits>
#include <filesystem>
#include <map>
#include <stdexcept>
#include <utility>

#include "api/load_assets.h"
#include "server/support/process_memory.h"
#include "server/support/read_file.h"
#include "server/worker/protocol/asset_directory.h"
#include "tracer/version.h"

namespace whittled {
namespace {

/// A result that does not fit on the disk is tried again for some seconds; the reserve file is deleted well before.
constexpr std::chrono::milliseconds disk_interval{500};

api::Limits document_limits(const Config& config) {
  api::Limits limits;
  limits.document.bytes = config.body_bytes;
  limits.scene.pixels = config.pixels;
  limits.scene.samples_times_pixels = config.samples_times_pixels;
  limits.scene.objects = config.objects;
  limits.scene.triangles = config.triangles;
  limits.scene.lights = static_cast<std::uint32_t>(config.lights);
  if (!config.assets.empty()) limits.files = api::Files::below_a_directory;
  limits.uploads = true;
  limits.webhooks = !config.webhook_secret_file.empty();
  return limits;
}

std::int64_t artifact_limit(const Config& config) {
  const std::uint64_t bytes =
      config.artifact_bytes != 0 ? config.artifact_bytes : std::filesystem::space(config.data).capacity / 2;
  return static_cast<std::int64_t>(bytes);
}

queue::Retention retention(const Config& config) {
  constexpr std::int64_t day_ms = std::int64_t{24} * 3600 * 1000;
  return {.expired_ms = queue::QueueSettings{}.retention.expired_ms,
          .succeeded_ms = static_cast<std::int64_t>(config.job_days) * day_ms,
          .failed_ms = static_cast<std::int64_t>(config.failed_job_days) * day_ms,
          .artifact_bytes = artifact_limit(config)};
}

queue::QueueSettings queue_settings(const Config& config, const Storage& storage) {
  return {.queued_limit = static_cast<std::int64_t>(config.queued_jobs),
          .owner_queued_limit = static_cast<std::int64_t>(config.key_queued_jobs),
          .owner_artifact_bytes_limit = static_cast<std::int64_t>(config.key_artifact_bytes),
          .retention = retention(config),
          .lease_ms = static_cast<std::int64_t>(config.lease_s) * 1000,
          .disk_space = [&disk = storage.disk] { return disk.now(); }};
}

/// The limits of GET /v1/version: options, and fixed limits.
std::vector<std::pair<std::string, std::uint64_t>> effective_limits(const Config& config, const api::Limits& limits) {
  const http::HeadLimits head;
  std::vector<std::pair<std::string, std::uint64_t>> all{{"asset_hashes", http::asset_hashes_max},
                                                         {"json_depth", limits.document.depth},
                                                         {"json_values", limits.document.values},
                                                         {"json_string_bytes", limits.document.string_bytes},
                                                         {"json_key_bytes", limits.document.key_bytes},
                                                         {"json_number_chars", limits.document.number_chars},
                                                         {"name_bytes", limits.document.name_bytes},
                                                         {"labels", limits.document.labels},
                                                         {"image_side", limits.scene.image_side},
                                                         {"max_depth", limits.scene.max_depth},
                                                         {"materials", limits.scene.materials},
                                                         {"textures", limits.scene.textures},
                                                         {"radiosity_patches", limits.scene.radiosity_patches},
                                                         {"wait_s", static_cast<std::uint64_t>(http::wait_max.count())},
                                                         {"request_line_bytes", head.request_line_bytes},
                                                         {"target_bytes", head.target_bytes},
                                                         {"header_count", head.header_count},
                                                         {"header_bytes", head.header_bytes}};
  for (const Option& option : options())
    if (option.is_limit) all.emplace_back(option.name, config.*std::get<std::uint64_t Config::*>(option.member));
  return all;
}

/// The daemon reads no file that a scene names, but it rejects scenes whose files are missing.
std::vector<tracer::Issue> missing_files(const tracer::Scene& scene, const std::string& directory_path,
                                         queue::AssetStore& uploads) {
  if (scene.assets.empty()) return {};
  std::optional<worker::AssetDirectory> directory;
  if (!directory_path.empty()) directory.emplace(directory_path);
  return api::check_assets(scene, [&](const std::string& name) -> std::string {
    if (!name.starts_with(api::upload_prefix)) return directory->refusal(name);  // the reader rejected others
    const std::string sha256 = name.substr(api::upload_prefix.size());
    return uploads.use(sha256) ? "" : "was not uploaded; PUT /v1/assets/" + sha256 + " uploads it";
  });
}

/// All nodes; without a shared database this one.
std::vector<queue::Node> nodes(Storage& storage, const worker::Supervisor& supervisor, queue::Node own) {
  if (storage.postgres) return storage.postgres->cluster().nodes();
  own.slots = supervisor.slots();
  own.running = supervisor.running();
  own.seen_at = storage.clock();
  return {own};
}

/// By role, those that were seen lately.
std::vector<std::pair<std::string, std::int64_t>> count_nodes(Storage& storage) {
  constexpr std::int64_t lately_ms = 10'000;
  if (!storage.postgres) return {{"all", 1}};
  std::map<std::string, std::int64_t> counts{{"all", 0}, {"api", 0}, {"worker", 0}};
  for (const queue::Node& node : storage.postgres->cluster().nodes())
    if (storage.clock() - node.seen_at < lately_ms) ++counts[node.role];
  return {counts.begin(), counts.end()};
}

}  // namespace

tracer::Result<Credentials, std::vector<ConfigError>> read_credentials(const Config& config) {
  Credentials credentials;
  std::vector<ConfigError> errors;
  if (!config.keys.empty()) {
    auto keys = keys::read(config.keys);
    if (keys) {
      credentials.keys = *std::move(keys);
    } else {
      for (const std::string& error : keys.error()) errors.push_back({"--keys", error});
    }
  }
  if (!config.webhook_secret_file.empty()) {
    try {
      auto secrets = webhooks::read_secrets(support::read_file(config.webhook_secret_file));
      if (!secrets) throw std::runtime_error(config.webhook_secret_file + ": " + secrets.error());
      credentials.webhook_secrets = *std::move(secrets);
    } catch (const std::runtime_error& failure) {
      errors.push_back({"--webhook-secret-file", failure.what()});
    }
  }
  auto networks = webhooks::Networks::parse(config.webhook_networks);
  if (networks) {
    credentials.webhook_networks = *std::move(networks);
  } else {
    errors.push_back({"--webhook-networks", networks.error()});
  }
  if (!errors.empty()) return errors;
  return credentials;
}

JobQueue::JobQueue(const Config& config, Storage& storage, const queue::Log& log)
    : artifact_bytes_max(artifact_limit(config)),
      ids(storage.clock, queue::system_random()),
      queue(storage.stores, storage.artifacts, ids, storage.clock, log, queue_settings(config, storage)),
      events(http::event_text, storage.clock, {.listeners_max = config.streams},
             [&store = storage.stores.jobs](const std::string& id) { return store.summary(id); }),
      link(storage.postgres ? std::make_unique<queue::NodeLink>(queue, events, storage.postgres->cluster(),
                                                                storage.postgres->wakeups(), log)
                            : nullptr),
      job_metrics(registry) {
  queue.notifications.observe(&job_metrics);
  queue.notifications.observe(link ? static_cast<queue::JobObserver*>(link.get()) : &events);
}

queue::Node own_node(const Config& config, const Storage& storage, const JobQueue& jobs) {
  std::array<char, HOST_NAME_MAX + 1> name{};
  ::gethostname(name.data(), name.size() - 1);
  const std::int64_t now = storage.clock();
  return {.id = jobs.queue.boot_id(),
          .name = name.data(),
          .role = config.role,
          .version = std::string(tracer::version()),
          .started_at = now,
          .seen_at = now};
}

void join_nodes(const Config& config, const queue::Node& node, JobQueue& jobs, const worker::Supervisor& supervisor) {
  if (!jobs.link) return;
  jobs.link->start({.node = node,
                    .load = [&supervisor] { return std::pair(supervisor.slots(), supervisor.running()); },
                    .has_clients = config.role != "worker"});
}

Maintenance::Maintenance(const Config& config, Storage& storage, JobQueue& jobs, const queue::Log& log)
    : disk_space(queue::repeat("measure_disk_space", log,
                               [&disk = storage.disk, &lifecycle = jobs.queue.lifecycle] {
                                 if (disk.measure()) lifecycle.on_disk_space_available();
                                 return disk_interval;
                               })),
      maintainer(queue::maintain(jobs.queue.lifecycle, log)),
      lease_renewer(
          queue::renew_leases(jobs.queue.lifecycle, log, std::chrono::milliseconds(config.lease_s * 1000 / 3))),
      collector(queue::collect_assets(storage.uploads, storage.stores.maintenance, storage.clock, log,
                                      {.age = std::chrono::days(static_cast<int>(config.asset_days))})),
      artifacts(queue::repeat("maintain_artifacts", log, [&storage, log] { return storage.maintain_artifacts(log); })) {
}

std::unique_ptr<webhooks::Webhooks> start_webhooks(const Credentials& credentials, Storage& storage, JobQueue& jobs,
                                                   const queue::Log& log) {
  if (credentials.webhook_secrets.empty()) return nullptr;
  const auto find = [&queries = jobs.queue.queries](const std::string& id) { return queries.find(id); };
  const auto sender = std::make_shared<const webhooks::WebhookSender>(
      webhooks::SenderSettings{.networks = credentials.webhook_networks});
  const auto send = [sender](const auto&... arguments) { return sender->post(arguments...); };
  webhooks::WebhookSettings settings{.secrets = credentials.webhook_secrets};
  if (storage.postgres) settings.search_interval = std::chrono::minutes(1);
  auto webhooks =
      std::make_unique<webhooks::Webhooks>(storage.deliveries, find, send, storage.clock, jobs.ids, log, settings);
  jobs.queue.notifications.set_completion_listener(webhooks.get());
  return webhooks;
}

worker::SupervisorSettings supervisor_settings(const Config& config, const Storage& storage) {
  worker::SupervisorSettings settings;
  if (storage.postgres) {
    settings.tasks = &storage.postgres->tasks();
    settings.wakeups = &storage.postgres->wakeups();
  }
  settings.executable = worker::default_executable();
  settings.claims_jobs = config.role != "api";
  settings.slots = static_cast<int>(config.jobs);
  settings.threads = static_cast<int>(config.threads);
  if (!config.keys.empty()) settings.owner_slots = static_cast<int>(config.key_running_jobs);
  settings.files = {config.assets, uploads_directory(config), config.objects, config.triangles};
  if (storage::objects::AssetCache* const cache = storage.asset_cache.get())
    settings.open_upload = [cache](const std::string& sha256) { return cache->open(sha256); };
  settings.waiting_directory = storage.spool_directory;
  settings.waiting_bytes = config.waiting_bytes;
  // Other nodes take a job over in time if this one cannot write its result for longer than the lease.
  if (storage.postgres) settings.store_tries = 0;
  settings.wall_time = std::chrono::seconds(config.wall_time_s);
  settings.job_memory_bytes = config.job_memory_bytes;
  settings.scene_cache_bytes = config.scene_cache_bytes;
  return settings;
}

http::HttpServerSettings api_server_settings(const Config& config, const Storage& storage, const keys::KeyRing* keys,
                                             telemetry::RequestMetrics& metrics) {
  http::HttpServerSettings settings;
  settings.host = config.listen.host;
  settings.port = config.listen.port;
  settings.connections_max = config.connections;
  settings.connections_per_address_max = config.connections_per_address;
  settings.descriptors_kept = 32;  // for the health listener, the stores and the worker
  settings.handler_threads = config.handler_threads;
  settings.head.body_bytes = config.body_bytes;
  settings.head.asset_bytes = config.asset_bytes;
  settings.access = [keys](const http::RequestHead& head) { return http::access_of(head, keys); };
  settings.on_response = [&metrics](const auto&... request) { metrics.count(request...); };
  settings.spool_directory = storage.spool_directory;
  settings.spool_bytes = config.spool_bytes;
  constexpr std::size_t downloads_at_once = 16;  // each waits for the store most of the time
  if (storage.shared_files) settings.body_threads = downloads_at_once;
  return settings;
}

http::HttpServerSettings health_server_settings(const Config& config, const Storage& storage) {
  http::HttpServerSettings settings;
  settings.host = config.health_listen.host;
  settings.port = config.health_listen.port;
  settings.connections_max = settings.connections_per_address_max = 256;
  settings.handler_threads = 1;
  settings.waiting_max = 64;
  if (config.keys.empty())
    settings.access = [](const http::RequestHead& head) { return http::access_of(head, nullptr); };
  settings.head.body_bytes = settings.head.asset_bytes = 0;
  settings.spool_directory = storage.spool_directory;
  return settings;
}

http::ApiContext api_context(const Config& config, Storage& storage, JobQueue& jobs,
                             const worker::Supervisor& supervisor, webhooks::Webhooks* webhooks,
                             const keys::KeyRing* keys, http::Readiness& readiness, const queue::Node& node) {
  const api::Limits limits = document_limits(config);
  http::ApiContext context{
      .queue = jobs.queue,
      .events = jobs.events,
      .assets = storage.uploads,
      .deliveries = storage.deliveries,
      .history = jobs.job_metrics.history(),
      .readiness = readiness,
      .clock = storage.clock,
      .limits = limits,
      .batch_limits = {limits, static_cast<int>(config.batch_jobs), config.batch_bytes, config.batch_values},
      .missing_files = [assets = config.assets, &uploads = storage.uploads](
                           const tracer::Scene& scene) { return missing_files(scene, assets, uploads); },
      .uploads_bytes = config.uploads_bytes,
      .job_memory_bytes = config.job_memory_bytes,
      .render_wait = std::chrono::seconds(config.render_wait_s),
      .effective_limits = effective_limits(config, limits),
      .sandbox = [&supervisor] { return supervisor.sandbox(); },
      .gauges = [&storage, &jobs, &supervisor] { return gauge_values(storage, jobs, supervisor, 0); },
      .nodes = [&storage, &supervisor, node] { return nodes(storage, supervisor, node); },
      .dashboard = config.dashboard == "on",
      .keys = keys};
  SharedFiles* const files = storage.shared_files.get();
  if (files != nullptr && config.artifact_redirect == "on")
    context.redirect = [files](const queue::Artifact& artifact) { return files->url_of(artifact); };
  if (webhooks != nullptr) {
    context.redeliver = [webhooks](const auto&... ids) { return webhooks->redeliver(ids...); };
    context.send_test_webhook = [webhooks](const std::string& url) { return webhooks->send_test(url); };
  }
  return context;
}

telemetry::GaugeValues gauge_values(Storage& storage, const JobQueue& jobs, const worker::Supervisor& supervisor,
                                    std::size_t connections) {
  using enum queue::JobState;
  telemetry::GaugeValues values;
  values.version = tracer::version();
  values.build = tracer::build();
  for (const queue::JobState state : {queued, running, succeeded, failed, cancelled}) {
    values.jobs.emplace_back(queue::name_of(state), storage.stores.statistics.count(state));
  }
  if (const auto oldest_at = storage.stores.statistics.depth().oldest_at) {
    values.queue_age_s = static_cast<double>(std::max<std::int64_t>(storage.clock() - *oldest_at, 0)) / 1000;
  }
  values.nodes = count_nodes(storage);
  values.disk_space = storage.disk.now();
  values.upload_bytes = storage.uploads.bytes();
  values.artifact_bytes = storage.stores.statistics.artifact_bytes();
  values.artifact_bytes_max = jobs.artifact_bytes_max;
  values.connections = connections;
  values.event_listeners = jobs.events.listeners();
  const auto cache = supervisor.cache_bytes();
  values.cache_geometry_bytes = cache.geometry;
  values.cache_image_bytes = cache.images;
  values.worker_pid = supervisor.worker_pid();
  values.worker_jobs = supervisor.running();
  values.worker_slots = supervisor.slots();
  values.rss_bytes = support::resident_bytes(::getpid());
  if (values.worker_pid > 0) values.worker_rss_bytes = support::resident_bytes(values.worker_pid);
  return values;
}

}  // namespace whittled
