#pragma once
/// HTTP messages between the server and the handlers: complete requests, and replies that are complete, streamed, or
/// deferred until an event. Routes connect both.

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "server/http/body.h"
#include "server/http/problem.h"
#include "server/http/request_head.h"
#include "server/keys/key_ring.h"
#include "tracer/result.h"

namespace http {

using Time = std::chrono::steady_clock::time_point;

/// Finds the key of a head, before its body is read; again if keys change before the body is complete, or while the
/// reply is deferred or streamed. None without keys, and for open routes. Problem: the request is refused whatever its
/// route is. Runs on the event loop and must not block.
using AccessFilter = std::function<tracer::Result<std::optional<keys::Key>, Problem>(const RequestHead&)>;

struct Request {
  std::string id;  ///< X-Request-Id of the reply and of every log line
  RequestHead head;
  Body body;
  std::string route;                    ///< the pattern that matched; empty if none did
  std::optional<keys::Key> key;         ///< see AccessFilter
  std::string remote;                   ///< address of the peer, from the socket
  std::vector<std::string> parameters;  ///< percent-decoded values of the {names} of the pattern, in order

  /// Name of the API key; empty without keys.
  [[nodiscard]] std::string owner() const { return key ? key->name : ""; }
};

/// A body of known size that is read while it is sent, never whole in memory.
struct BodySource {
  std::uint64_t size_bytes = 0;
  /// Reads up to `size` bytes at `offset`; fewer only at the end. If it throws, the reply is cut short, which the
  /// client detects by Content-Length. Runs on the event loop and must not block, unless
  /// HttpServerSettings::body_threads run it.
  std::function<std::size_t(std::uint64_t offset, char* into, std::size_t size)> read;
};

/// A body of unknown size that is sent as it is produced. It occupies no thread. Output that the client does not read
/// stays with the producer, which must bound it. Destroyed when the client disconnects.
struct BodyStream {
  struct Chunk {
    std::string text;
    bool last = false;  ///< the connection closes after it
  };
  /// Returns new output, some KiB at a time; empty if there is none. Runs on the event loop and must not block.
  std::function<Chunk()> take;
  /// Registers `notify`, which is called when there is new output, from any thread, also after the end of the server.
  /// Called once.
  std::function<void(std::function<void()> notify)> watch;
  /// Sent after each interval without output, so that proxies and clients keep the connection.
  std::string heartbeat;
  std::chrono::milliseconds heartbeat_interval{15'000};
};

/// With an ETag that the client's If-None-Match names, a 200 of GET or HEAD is sent as 304.
struct Reply {
  int status = 200;
  std::string content_type{};  ///< empty: no body
  Pairs headers{};
  std::string body{};
  std::optional<BodySource> source{};    ///< instead of `body`
  std::shared_ptr<BodyStream> stream{};  ///< after `body`; not for HEAD
  std::optional<Failure> failure{};      ///< for the log
  std::string job_id{};                  ///< for the log
};

/// A reply that is produced later, after a notification or at the deadline. Until then the request occupies no thread.
/// If the client disconnects or the deadline passes, the watch is stopped.
struct DeferredReply {
  Time deadline;
  /// Starts the watch. `notify` may be called several times, spuriously, at once, from any thread, and after the end
  /// of the server. Returns a function that stops the watch; it runs on the event loop and must not block.
  std::function<std::function<void()>(std::function<void()> notify)> watch;
  /// Produces the reply, or defers it again. Runs on a handler thread.
  std::function<std::variant<Reply, DeferredReply, Problem>(bool timed_out)> resume;
  /// Called on a handler thread if the client disconnects or loses its access meanwhile. May be empty.
  std::function<void()> on_disconnected = {};
};

using Answer = std::variant<Reply, DeferredReply, Problem>;

/// Processes a request. Called from several threads at once. An exception becomes a problem without details.
using Handler = std::function<Answer(Request&)>;

/// The key that a request needs if there are keys.
enum class RequiredKey {
  of_method,  ///< one with the scope jobs:read for GET and HEAD, jobs:write for other methods
  reading,    ///< one with jobs:read
  any,
  none  ///< the route is open to everyone
};

struct RouteRules {
  std::vector<std::string> query{};  ///< accepted query parameters; requests with others are refused
  bool one_at_a_time = false;        ///< takes up to seconds: one thread handles the requests of all such routes
  RequiredKey key = RequiredKey::of_method;
};

struct Route {
  std::string method;   ///< GET also serves HEAD
  std::string pattern;  ///< "/v1/jobs/{id}": a name in braces matches one segment of the path
  Handler handler;
  RouteRules rules{};
};

/// The values of the {names} of `pattern` in `path`; nothing if the path does not match.
std::optional<std::vector<std::string>> match(std::string_view pattern, std::string_view path);

/// The problem of a key without the scope that the route needs.
std::optional<Problem> scope_problem(const std::optional<keys::Key>& key, const Route& route);

Reply problem_reply(const Problem& problem, const std::string& request_id);

/// The bytes of a reply except for its source: status line, headers and body. `to_head`: the request was HEAD, so the
/// body is left out.
std::string serialized(const Reply& reply, const std::string& request_id, bool keep_alive, bool to_head);

}  // namespace http
