#pragma once
/// The gate: one epoll loop owns every socket of a listener, reads whole checked requests within limits and deadlines,
/// hands them to a few handler threads and writes the replies. Nothing that a client does, or omits, holds a thread:
/// slow heads, slow bodies, slow readers, silence and waiting for a job all stay with the loop.
///
///   http::Gate gate(settings, routes, new_request_id, log);   // listens and serves
///   ... gate.port() ...
///   gate.drain(std::chrono::seconds(5));                      // finishes what has begun
///
/// One loop thread and `handler_threads` others. All functions are thread-safe but construction and destruction.

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/http/connection.h"
#include "server/http/pending_request.h"
#include "server/telemetry/json_log.h"

namespace http {

/// How a request went, for figures. `route` is its pattern, empty where it has none.
using Told = std::function<void(std::string_view method, std::string_view route, int status, double seconds)>;

struct GateSettings {
  std::string host = "127.0.0.1";  ///< a literal address
  std::uint16_t port = 0;          ///< 0: a free one
  std::size_t connections_max = 20'000;
  std::size_t connections_per_address_max = 20'000;
  std::size_t handler_threads = 4;
  /// Complete requests that wait for a handler; more are answered 503 at once. At 10 ms each four threads are half a
  /// second behind then, and more would only wait longer.
  std::size_t waiting_max = 256;
  HeadLimits head;
  Told told;         ///< of every request that is answered, from any thread; must not throw
  HeadFilter judge;  ///< none: every head is right
  ConnectionTimes times;
  std::string spool_directory = "/tmp";    ///< for bodies over 1 MiB; exists
  std::uint64_t spool_bytes = 2ull << 30;  ///< of all of them; further ones are answered 503
};

class HttpServer {
 public:
  /// Ignores SIGPIPE for the process. Throws std::system_error when it cannot listen. `new_request_id` is called from
  /// the loop.
  HttpServer(const GateSettings& settings, const std::vector<Route>& routes,
             std::function<std::string()> new_request_id, const telemetry::Log& log);
  ~HttpServer();  ///< without a drain before, connections are cut

  [[nodiscard]] std::uint16_t port() const;
  [[nodiscard]] std::size_t connections() const;  ///< open now

  /// Takes no more connections, closes idle ones, resumes parked requests as timed out, and waits until all that has
  /// begun is answered, at most `grace`. Afterwards the gate serves no one.
  void drain(std::chrono::milliseconds grace);

 private:
  class Loop;
  std::unique_ptr<Loop> loop_;
};

}  // namespace http
