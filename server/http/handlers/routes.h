#pragma once
/// Every route of the service (api/docs/http.md), as values for a Gate. api/openapi.yaml describes the same; a test
/// holds both together.

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/batch.h"
#include "api/document.h"
#include "server/http/router.h"
#include "server/keys/key_ring.h"
#include "server/queue/asset_store.h"
#include "server/queue/clock.h"
#include "server/queue/delivery_store.h"
#include "server/queue/disk_space.h"
#include "server/queue/events.h"
#include "server/queue/queue.h"

namespace http {

/// The longest that a request may wish to wait; proxies cut at 60 s.
constexpr std::chrono::seconds wait_max{60};

/// What the client routes need. The functions and the service are thread-safe and outlive the gate.
struct ApiContext {
  queue::Queue& queue;
  queue::Events& events;
  queue::AssetStore& assets;
  queue::Clock clock;
  api::Limits limits;
  api::BatchLimits batch_limits;  ///< their `document` is `limits`
  /// An issue for each file that the scene names and that is not there to be read; uploaded ones are used now. Unset:
  /// `limits` let none be named.
  std::function<std::vector<tracer::Issue>(const tracer::Scene&)> missing_files;
  std::function<std::string(std::string_view)> sha256;  ///< of bytes, as 64 hex digits
  /// What was sent, and is owed, to those who want to hear of a job's end, oldest first.
  std::function<std::vector<queue::Delivery>(const std::string& job_id)> deliveries;
  queue::DiskSpaceProbe room = [] { return queue::DiskSpace{}; };  ///< the disk's
  std::uint64_t job_memory_bytes = 16ull << 30;             ///< scenes that are estimated to take more are refused
  std::chrono::milliseconds render_wait{60'000};            ///< see the option render_wait_s
  std::function<bool()> draining;                           ///< true: new work is refused, reads are answered
  std::function<std::optional<double>()> seconds_per_work;  ///< see api::write_valid
  std::vector<std::pair<std::string, std::uint64_t>> effective_limits;  ///< what GET /v1/version tells, by option name
  std::function<std::string()> sandbox{};                               ///< what holds the worker; empty: not known yet
  const keys::KeyRing* keys = nullptr;                                  ///< null: this machine's users need none
};
std::vector<Route> client_routes(const ApiContext& front);

/// What the health routes need; the same rules.
struct Health {
  std::function<std::string()> not_ready;  ///< empty: ready; else the reason. Asked at most once a second
  std::function<bool()> draining;          ///< true: not ready, whatever not_ready said a moment ago
  std::function<std::string()> metrics;    ///< the Prometheus text; may throw StoreFailure
};
std::vector<Route> health_routes(const Health& health);

/// An event in the format of server-sent events (HTML Living Standard, section 9.2): "id: n", "event: state",
/// "data: {...}" and an empty line.
std::string event_text(const queue::JobEvent& event);

}  // namespace http
