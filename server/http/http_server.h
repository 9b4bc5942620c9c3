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
#include <string_view>
#include <vector>

#include "server/http/http_messages.h"
#include "server/telemetry/json_log.h"

namespace http {

class EventLoop;

/// Time limits of one client. They bound the resources that it can hold.
struct ConnectionTimes {
  std::chrono::milliseconds idle{75'000};         ///< between requests; longer than the idle time of common proxies
  std::chrono::milliseconds head{10'000};         ///< from the first byte of a head to its last
  std::chrono::milliseconds body_grace{10'000};   ///< for a body, in addition to its bytes at `bytes_per_s`
  std::chrono::milliseconds write_grace{30'000};  ///< for a reply, in addition to its bytes at `bytes_per_s`
  std::chrono::milliseconds linger{2'000};        ///< for the client to read a refusal before the socket is closed
  std::uint64_t bytes_per_s = 16u << 10;          ///< least average rate of bodies and replies: a slow mobile line
};

/// Receives the outcome of a request. `route` is the pattern; it is empty if no route matched.
using OnResponse = std::function<void(std::string_view method, std::string_view route, int status, double seconds)>;

struct HttpServerSettings {
  std::string host = "127.0.0.1";  ///< a literal address
  std::uint16_t port = 0;          ///< 0: any free port
  std::size_t connections_max = 20'000;
  std::size_t connections_per_address_max = 20'000;
  int descriptors_kept = 0;  ///< clients leave so many to the rest of the process; further ones are closed
  std::size_t handler_threads = 4;
  /// Complete requests that wait for a handler; further ones are answered 503 at once. At 10 ms each the last of them
  /// waits for half a second with four threads.
  std::size_t waiting_max = 256;
  /// Threads that read BodySources, for those that wait for a network; 0: the event loop reads them.
  std::size_t body_threads = 0;
  HeadLimits head;
  OnResponse on_response;  ///< called for every answered request, from any thread; must not throw
  AccessFilter access;     ///< empty: every request has access
  ConnectionTimes times;
  std::string spool_directory = "/tmp";    ///< for bodies over 1 MiB; must exist
  std::uint64_t spool_bytes = 2ull << 30;  ///< for all spooled bodies; further ones are answered 503
};

class HttpServer {
 public:
  /// Ignores SIGPIPE for the process. Throws std::system_error if it cannot listen. `new_request_id` is called on the
  /// event loop.
  HttpServer(const HttpServerSettings& settings, std::vector<Route> routes, std::function<std::string()> new_request_id,
             const telemetry::Log& log);
  ~HttpServer();  ///< without a drain before, connections are closed

  [[nodiscard]] std::uint16_t port() const;
  [[nodiscard]] std::size_t connections() const;  ///< open now

  /// Ends the event streams, and answers the deferred replies and the requests whose body is still read, if they have
  /// no access now. Any thread.
  void check_access();

  /// Stops accepting connections, closes idle ones, resumes deferred replies as timed out, and waits at most `grace`
  /// until every received request is answered. Afterwards the server accepts nothing.
  void drain(std::chrono::milliseconds grace);

 private:
  std::unique_ptr<EventLoop> loop_;
};

}  // namespace http
