#pragma once
/// The values between the gate and the handlers: a request that has been read completely, the reply to it, or the wish
/// to answer later. Neither side sees the other's machinery; no HTTP library is seen here.

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

namespace http {

struct Request {
  std::string id;  ///< X-Request-Id of the reply and of every log line
  RequestHead head;
  Body body;
  std::string route;              ///< its pattern; empty where none fits
  std::string owner;              ///< the name of the key that it came with; empty where there are no keys
  std::string remote;             ///< the peer's address, from the socket
  std::vector<std::string> path;  ///< what the pattern's {names} stand for in this path, in order; percent-decoded
};

/// A body that is read while it is sent, never whole in memory.
struct BodySource {
  std::uint64_t size_bytes = 0;
  /// Up to `size` bytes at `offset` of the body; fewer than asked only at the end. May throw: the reply is cut short
  /// then, which the client sees from Content-Length. Called from the gate's loop, so it must not wait for anyone.
  std::function<std::size_t(std::uint64_t offset, char* into, std::size_t size)> read;
};

/// A body without an end that is known: text as it comes, while the client listens. The gate's loop holds it, no
/// thread. What the client does not read stays with the source, whose affair it is to bound it. It is destroyed when
/// the client leaves.
struct BodyStream {
  struct Piece {
    std::string text;
    bool over = false;  ///< nothing follows: the connection closes after it
  };
  /// What is new, in pieces of some KiB; empty: nothing. Called from the gate's loop, so it must not wait for anyone.
  std::function<Piece()> take;
  /// Calls `wake` when there is something to take, from any thread, also after the gate is gone. Called once.
  std::function<void(std::function<void()> wake)> watch;
  /// Sent after each `quiet` without anything else, so that proxies and clients know that the line is alive.
  std::string sign_of_life;
  std::chrono::milliseconds quiet{15'000};
};

struct Reply {
  int status = 200;
  std::string content_type;  ///< empty where there is no body
  Pairs headers;
  std::string body;
  std::optional<BodySource> source;    ///< instead of `body`
  std::shared_ptr<BodyStream> stream;  ///< after `body`; HEAD gets none
  std::optional<Failure> failure;      ///< for the log
  std::string job_id;                  ///< for the log
};

/// The answer comes later, when `wake` is called or the deadline passes; until then the request holds no thread.
/// When the client leaves, or the deadline passes, the watch is stopped and forgotten.
struct DeferredReply {
  std::chrono::steady_clock::time_point deadline;
  /// Starts watching. `wake` may be called without need, several times, at once, from
  /// any thread, and after the gate is gone.
  /// Returns what stops the watch; that is called from the gate's loop and must be quick.
  std::function<std::function<void()>(std::function<void()> wake)> watch;
  /// Answers, on a handler's thread.
  std::function<std::variant<Reply, DeferredReply>(bool timed_out)> resume;
};

using Answer = std::variant<Reply, DeferredReply>;

/// Reads the request, calls the domain, maps what it says, writes the answer. Called from several threads at once.
/// What it throws becomes a problem without details.
using Handler = std::function<Answer(Request&)>;

struct Route {
  std::string method;   ///< GET answers HEAD too
  std::string pattern;  ///< "/v1/jobs/{id}": a name in braces stands for one segment of the path
  Handler handler;
  std::vector<std::string> query;  ///< the query parameters it takes; others are refused
};

/// A problem as its reply. `request_id` goes into the body.
Reply problem_reply(const Problem& problem, const std::string& request_id);

/// The bytes of a reply but for its source: status line, headers, body. `to_head`: the request was HEAD, so no body.
std::string serialized(const Reply& reply, const std::string& request_id, bool keep_alive, bool to_head);

}  // namespace http
