#pragma once
/// The layers of the daemon, each built from Config and the layers below it. main.cpp connects them.

#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "server/daemon/config.h"
#include "server/daemon/storage.h"
#include "server/http/handlers/routes.h"
#include "server/http/http_server.h"
#include "server/keys/key_ring.h"
#include "server/queue/events.h"
#include "server/queue/node_link.h"
#include "server/queue/queue.h"
#include "server/queue/queue_maintainer.h"
#include "server/telemetry/service_metrics.h"
#include "server/webhooks/webhooks.h"
#include "server/worker/supervisor/supervisor.h"

namespace whittled {

/// Content of the files that the configuration names, and options that need a parser of another module.
struct Credentials {
  std::optional<std::vector<keys::Key>> keys;     ///< nothing: no keys are needed
  std::vector<webhooks::Secret> webhook_secrets;  ///< empty: no webhooks
  webhooks::Networks webhook_networks;
};
tracer::Result<Credentials, std::vector<ConfigError>> read_credentials(const Config& config);

// ---- start_check.cpp; nothing is created or changed
/// Everything that would stop the start, except what a running daemon with the same configuration causes.
std::vector<ConfigError> find_start_errors(const Config& config);
/// Addresses and data that another process uses, such as a running daemon.
std::vector<ConfigError> find_conflicts(const Config& config);

/// The queue and its observers: event streams and metrics.
struct JobQueue {
  JobQueue(const Config& config, Storage& storage, const queue::Log& log);

  const std::int64_t artifact_bytes_max;  ///< see option artifact_bytes
  queue::IdSource ids;
  queue::Queue queue;
  queue::Events events;
  const std::unique_ptr<queue::NodeLink> link;  ///< null: there are no other nodes
  prometheus::Registry registry;
  telemetry::JobMetrics job_metrics;
};

/// Threads that measure free space, expire jobs, renew leases, delete unused uploads and maintain the images.
struct Maintenance {
  Maintenance(const Config& config, Storage& storage, JobQueue& jobs, const queue::Log& log);

  std::jthread disk_space, maintainer, lease_renewer, collector, artifacts;
};

/// Null without secrets. `webhooks` of api_context is this.
std::unique_ptr<webhooks::Webhooks> start_webhooks(const Credentials& credentials, Storage& storage, JobQueue& jobs,
                                                   const queue::Log& log);

/// This daemon, for GET /v1/nodes.
queue::Node own_node(const Config& config, const Storage& storage, const JobQueue& jobs);
/// Begins the exchange with other nodes, if there may be any.
void join_nodes(const Config& config, const queue::Node& node, JobQueue& jobs, const worker::Supervisor& supervisor);

worker::SupervisorSettings supervisor_settings(const Config& config, const Storage& storage);

// ---- HTTP. `keys`: null if no keys are needed. All arguments but `config` must outlive the servers.

http::HttpServerSettings api_server_settings(const Config& config, const Storage& storage, const keys::KeyRing* keys,
                                             telemetry::RequestMetrics& metrics);
/// One thread suffices for three short routes, and none has a body.
http::HttpServerSettings health_server_settings(const Config& config, const Storage& storage);

http::ApiContext api_context(const Config& config, Storage& storage, JobQueue& jobs,
                             const worker::Supervisor& supervisor, webhooks::Webhooks* webhooks,
                             const keys::KeyRing* keys, http::Readiness& readiness, const queue::Node& node);

/// Throws queue::StoreFailure.
telemetry::GaugeValues gauge_values(Storage& storage, const JobQueue& jobs, const worker::Supervisor& supervisor,
                                    std::size_t connections);

}  // namespace whittled
