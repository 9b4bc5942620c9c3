#pragma once
/// Settings of the HTTP server.

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "server/http/problem.h"
#include "server/http/request_head.h"

namespace http {

/// Time limits of one client. They bound the resources that it can hold.
struct ConnectionTimes {
  std::chrono::milliseconds idle{75'000};         ///< between requests; longer than the idle time of common proxies
  std::chrono::milliseconds head{10'000};         ///< from the first byte of a head to its last
  std::chrono::milliseconds body_grace{10'000};   ///< for a body, in addition to its bytes at `bytes_per_s`
  std::chrono::milliseconds write_grace{30'000};  ///< for a reply, in addition to its bytes at `bytes_per_s`
  std::chrono::milliseconds linger{2'000};        ///< for the client to read a refusal before the socket is closed
  std::uint64_t bytes_per_s = 16u << 10;          ///< least average rate of bodies and replies: a slow mobile line
};

/// Checks a head before the body is read; returns the problem to refuse the request with. Runs on the event loop and
/// must not block.
using HeadFilter = std::function<std::optional<Problem>(const RequestHead&)>;

/// Receives the outcome of a request. `route` is the pattern; it is empty if no route matched.
using OnResponse = std::function<void(std::string_view method, std::string_view route, int status, double seconds)>;

struct HttpServerSettings {
  std::string host = "127.0.0.1";  ///< a literal address
  std::uint16_t port = 0;          ///< 0: any free port
  std::size_t connections_max = 20'000;
  std::size_t connections_per_address_max = 20'000;
  std::size_t handler_threads = 4;
  /// Complete requests that wait for a handler; further ones are answered 503 at once. At 10 ms each the last of them
  /// waits for half a second with four threads.
  std::size_t waiting_max = 256;
  HeadLimits head;
  OnResponse on_response;  ///< called for every answered request, from any thread; must not throw
  HeadFilter head_filter;  ///< empty: every head is accepted
  ConnectionTimes times;
  std::string spool_directory = "/tmp";    ///< for bodies over 1 MiB; must exist
  std::uint64_t spool_bytes = 2ull << 30;  ///< for all spooled bodies; further ones are answered 503
};

}  // namespace http
