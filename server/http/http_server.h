#pragma once
/// The HTTP server: one epoll loop owns every socket of a listener, reads complete and checked requests within limits
/// and deadlines, passes them to a few handler threads and writes the replies. Slow heads, slow bodies, slow readers,
/// idle connections and deferred replies occupy no thread: they stay with the loop.
///
///   http::HttpServer server(settings, routes, new_request_id, log);   // listens and serves
///   ... server.port() ...
///   server.drain(std::chrono::seconds(5));                            // completes the requests that were received
///
/// Runs one loop thread and `handler_threads` others. All functions except construction and destruction are
/// thread-safe.

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/http/router.h"
#include "server/http/server_settings.h"
#include "server/telemetry/json_log.h"

namespace http {

class EventLoop;

class HttpServer {
 public:
  /// Ignores SIGPIPE for the process. Throws std::system_error if it cannot listen. `new_request_id` is called on the
  /// event loop.
  HttpServer(const HttpServerSettings& settings, std::vector<Route> routes, std::function<std::string()> new_request_id,
             const telemetry::Log& log);
  ~HttpServer();  ///< without a drain before, connections are closed

  [[nodiscard]] std::uint16_t port() const;
  [[nodiscard]] std::size_t connections() const;  ///< open now

  /// Stops accepting connections, closes idle ones, resumes deferred replies as timed out, and waits at most `grace`
  /// until every received request is answered. Afterwards the server accepts nothing.
  void drain(std::chrono::milliseconds grace);

 private:
  std::unique_ptr<EventLoop> loop_;
};

}  // namespace http
