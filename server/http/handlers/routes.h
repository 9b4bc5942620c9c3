#pragma once
/// All routes of the service (api/docs/http.md), for an HttpServer, and the access to them: with API keys if there are
/// any, otherwise for local clients only. A test compares the routes with api/openapi.yaml.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "api/batch.h"
#include "api/document.h"
#include "server/http/handlers/image_results.h"
#include "server/http/handlers/lru_cache.h"
#include "server/http/http_messages.h"
#include "server/keys/key_ring.h"
#include "server/queue/asset_store.h"
#include "server/queue/clock.h"
#include "server/queue/cluster_store.h"
#include "server/queue/delivery_store.h"
#include "server/queue/events.h"
#include "server/queue/queue.h"
#include "server/telemetry/service_metrics.h"

namespace http {

/// Longest wait of a request; proxies disconnect after 60 s.
constexpr std::chrono::seconds wait_max{60};

/// Most hashes of POST /v1/assets/missing. A scene of a thousand files is large; ten thousand lookups take some tens of
/// ms.
constexpr std::size_t asset_hashes_max = 10'000;

/// Readiness of the service. Thread-safe.
class Readiness {
 public:
  /// `not_ready` returns the reason, or nothing. It costs a durable write, so its result is kept for a second.
  Readiness(std::function<std::string()> not_ready, const std::atomic<bool>& draining)
      : not_ready_(std::move(not_ready)), draining_(draining) {}
  std::string reason();                                      ///< empty: ready
  [[nodiscard]] bool draining() const { return draining_; }  ///< true: new work is refused, reads are answered

 private:
  const std::function<std::string()> not_ready_;
  const std::atomic<bool>& draining_;
  std::mutex mutex_;
  std::optional<std::chrono::steady_clock::time_point> probed_at_;
  std::string reason_;
};

/// Dependencies of the client routes. Functions and referenced objects are thread-safe and outlive the server.
struct ApiContext {
  queue::Queue& queue;
  queue::Events& events;
  queue::AssetStore& assets;
  queue::DeliveryStore& deliveries;
  const telemetry::ServiceHistory& history;
  Readiness& readiness;
  queue::Clock clock;
  api::Limits limits;
  api::BatchLimits batch_limits;  ///< their `document` is `limits`
  /// Returns an issue for each file of the scene that cannot be read, and marks uploaded ones as used.
  std::function<std::vector<tracer::Issue>(const tracer::Scene&)> missing_files;
  /// See webhooks::Webhooks; both are unset if none are sent.
  std::function<bool(const std::string& job_id, const std::string& delivery_id)> redeliver{};
  std::function<std::string(const std::string& url)> send_test_webhook{};
  std::uint64_t uploads_bytes = 0;                ///< limit of `assets`, for messages
  std::uint64_t job_memory_bytes = 16ull << 30;   ///< scenes with a greater estimate are refused
  std::chrono::milliseconds render_wait{60'000};  ///< option render_wait_s
  /// The URL that an image is to be read from; empty, or nothing: from the service.
  std::function<std::optional<std::string>(const queue::Artifact&)> redirect{};
  std::vector<std::pair<std::string, std::uint64_t>> effective_limits;  ///< for GET /v1/version, by option name
  std::function<std::string()> sandbox{};                               ///< sandbox of the worker; empty: unknown yet
  std::function<telemetry::GaugeValues()> gauges{};                     ///< without connections
  std::function<std::vector<queue::Node>()> nodes{};
  bool dashboard = true;                ///< the page at /; false: text only
  const keys::KeyRing* keys = nullptr;  ///< null: local clients without keys
  std::shared_ptr<handlers::ImageTasks> image_tasks = std::make_shared<handlers::ImageTasks>(queue.runner, render_wait);
  /// Succeeded jobs, without their reports, whose images were read lately, so that they can be read while the database
  /// is away: their images change only by expiry or removal. About 10 MB.
  std::shared_ptr<handlers::LruCache<queue::Job>> recent_jobs =
      std::make_shared<handlers::LruCache<queue::Job>>(10'000);
};
std::vector<Route> client_routes(const ApiContext& context);

/// The key of a request, see AccessFilter. With keys (`ring`): the key, or the ticket of a GET, must be valid, except
/// for open routes. Every key with jobs:read can read all jobs, as a service belongs to one team. Without keys (null):
/// Host must be this machine, because a web page in a local browser could use a name of its own that
/// resolves to this machine (DNS rebinding); and a page of another site may only read, because browsers send its
/// requests without a body unasked (Fetch Metadata, W3C 2021; Origin, RFC 6454). A key cannot be sent in this way.
tracer::Result<std::optional<keys::Key>, Problem> access_of(const RequestHead& head, const keys::KeyRing* ring);

/// `readiness` must outlive the routes. `metrics` returns the Prometheus text, and may throw StoreFailure.
std::vector<Route> health_routes(Readiness& readiness, const std::function<std::string()>& metrics);

/// Reply of /readyz of the health listener: "ready", or the reason why it is not. `ready`: it was 200 within 3 s.
struct Probe {
  bool ready = false;
  std::string answer;
};
/// `host` is the listen address; a wildcard address is probed on the loopback address of its family.
Probe probe(const std::string& host, std::uint16_t port);

/// An event in the format of server-sent events (HTML Living Standard, section 9.2): "id: n", "event: state",
/// "data: {...}" and an empty line.
std::string event_text(const queue::JobEvent& event);

}  // namespace http
