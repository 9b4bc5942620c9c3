#pragma once
/// Requests between the event loop and the handler threads.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "server/http/http_messages.h"
#include "server/http/timer_queue.h"
#include "server/support/event_queue.h"

namespace http {

/// Used by the event loop or by one handler thread, never by both at once.
struct PendingRequest {
  std::uint64_t client = 0;  ///< number of the client
  Request request;
  Time started;  ///< when the request was complete
  DeferredReply deferred;
};

/// A reply is complete.
struct ReplyReady {
  std::shared_ptr<PendingRequest> pending;
  std::string text;  ///< head and body
  std::optional<BodySource> source;
  std::shared_ptr<BodyStream> stream;
  bool keep_alive = false;
};
/// A reply is deferred, and its watch has started.
struct ReplyDeferred {
  std::shared_ptr<PendingRequest> pending;
  std::function<void()> stop_watching;
};
/// The watch of a deferred reply or of a stream notifies.
struct Notification {
  std::uint64_t client = 0;
  std::weak_ptr<PendingRequest> pending;
};
/// drain() was called.
struct DrainRequest {};

using ServerEvent = std::variant<ReplyReady, ReplyDeferred, Notification, DrainRequest>;

/// Shared with the watches, which may notify after the end of the server.
using ServerEvents = support::EventQueue<ServerEvent>;

}  // namespace http
