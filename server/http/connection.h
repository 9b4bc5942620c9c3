#pragma once
/// Connected clients: their sockets, the request and the reply that are in progress, and the events that concern them.
/// Used by the event loop's thread only, without access to epoll and handlers.

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <variant>
#include <vector>

#include "server/http/body.h"
#include "server/http/http_messages.h"
#include "server/http/http_server.h"
#include "server/http/listener.h"
#include "server/support/descriptor.h"
#include "server/support/event_queue.h"

namespace http {

/// The socket of one client: reads one checked request at a time within limits and deadlines, then writes its reply.
///
///   reading_head -> reading_body -> handling -> writing -> reading_head ... | lingering -> closed
///                                            -> streaming -> lingering -> closed
///
/// Nothing is read while a request is handled, so pipelined requests wait in the socket and are answered in order.
class Connection {
 public:
  enum class State { reading_head, reading_body, handling, writing, streaming, lingering, closed };

  /// `socket` is connected and non-blocking. The references must outlive the connection.
  Connection(support::Descriptor socket, std::string remote, const HttpServerSettings& settings, BodyBudget& budget,
             Time now);

  [[nodiscard]] int fd() const { return socket_.get(); }
  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] const std::string& remote() const { return remote_; }
  [[nodiscard]] Time deadline() const { return deadline_; }  ///< Time::max(): none
  [[nodiscard]] bool needs_input() const;
  [[nodiscard]] bool has_output() const { return written_ < output_.size() || sendable() > 0; }
  /// Between requests, with no byte of the next one read.
  [[nodiscard]] bool is_idle() const { return state_ == State::reading_head && input_.empty(); }

  /// Reads the available bytes. Afterwards a request may be complete (state handling, `request` is set), refused
  /// (`refusal` is set), or the connection closed.
  void receive(Time now);
  /// Parses a pipelined request whose bytes were received before. Call after a reply.
  void proceed(Time now);

  std::optional<Request> request;  ///< complete, for the event loop to take; its id is empty
  std::optional<Problem> refusal;  ///< for the event loop to take and to answer

  /// Starts the reply: `text` is head and body, `source` follows.
  void reply(std::string text, std::optional<BodySource> source, bool keep_alive, Time now);
  /// Starts a reply whose body comes by `append` until `end_stream`. Appended text must be sent within the write grace.
  void start_stream(std::string text, Time now);
  void append(std::string text, Time now);
  void end_stream(Time now);

  /// A part of the body of a reply, to be read by another thread (HttpServerSettings::body_threads).
  struct BodyPart {
    BodySource source;
    std::uint64_t offset = 0;
    std::size_t size = 0;
  };
  /// The next part, when all before it was sent. Nothing until it has come.
  std::optional<BodyPart> take_body_part(Time now);
  void add_body_part(std::string bytes, Time now);  ///< empty: it could not be read, and the reply is cut short

  /// Writes as much as the socket accepts. After the last byte the next request is read or the connection ends.
  void send(Time now);

  /// Stops reading the request and sets `refusal`.
  void refuse(Problem problem);
  /// Refuses the request whose body is read if it has no access any more.
  void check_access();

  /// Call when `deadline()` has passed.
  void expire();
  void close();

 private:
  void read_input(Time now);
  void start_body(RequestHead head, std::optional<keys::Key> key, Time now);
  void fill_body();
  void finish_reply(Time now);
  [[nodiscard]] ssize_t send_bytes(std::string_view bytes) const;
  ssize_t send_source();
  [[nodiscard]] std::uint64_t source_left() const { return source_ ? source_->size_bytes - source_written_ : 0; }
  /// Bytes of the source that can be sent now.
  [[nodiscard]] std::uint64_t sendable() const {
    return settings_.body_threads == 0 ? source_left() : part_.size() - part_written_;
  }
  /// The deadline of a transfer of `bytes` that began at started_.
  [[nodiscard]] Time transfer_deadline(std::chrono::milliseconds grace, std::uint64_t bytes) const;

  support::Descriptor socket_;
  State state_ = State::reading_head;
  std::string remote_;
  const HttpServerSettings& settings_;
  BodyBudget& budget_;
  Time deadline_;
  Time started_{};  ///< beginning of the body or of the reply

  std::string input_;  ///< received and not parsed; at most a head and the bytes of one read
  std::optional<Request> incoming_;

  std::string output_;
  std::uint64_t written_ = 0;         ///< bytes of output_ that were sent
  std::optional<BodySource> source_;  ///< follows output_
  std::uint64_t source_written_ = 0;
  std::string part_;  ///< read by another thread
  std::size_t part_written_ = 0;
  std::optional<Time> part_requested_;  ///< while it is read
  bool keep_alive_ = false;
};

/// A request between the event loop and the handler threads. Used by one of them at a time.
struct PendingRequest {
  std::uint64_t client = 0;  ///< number of the client
  Request request;
  const Route* route = nullptr;   ///< null: there is none for its path and method
  std::set<std::string> allowed;  ///< methods of its path without a route
  Time started;                   ///< when the request was complete
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
/// A part of the body of a reply was read.
struct BodyPartRead {
  std::uint64_t client = 0;
  std::string bytes;
};
/// The watch of a deferred reply or of a stream notifies.
struct Notification {
  std::uint64_t client = 0;
  std::weak_ptr<PendingRequest> pending;
};
/// drain() was called.
struct DrainRequest {};
/// check_access() was called.
struct AccessCheck {};

using ServerEvent = std::variant<ReplyReady, ReplyDeferred, BodyPartRead, Notification, DrainRequest, AccessCheck>;

/// Shared with the watches, which may notify after the end of the server.
using ServerEvents = support::EventQueue<ServerEvent>;

/// A client with the request and the reply that are in progress.
struct Client {
  Client(std::uint64_t unique_number, Listener::Accepted accepted, const HttpServerSettings& settings,
         BodyBudget& budget, Time now)
      : number(unique_number),
        connection(std::move(accepted.socket), std::move(accepted.remote), settings, budget, now) {}

  [[nodiscard]] bool is_deferred() const { return stop_watching != nullptr; }
  /// The client waits for an event, so that its disconnection must be noticed.
  [[nodiscard]] bool is_waiting() const { return is_deferred() || stream != nullptr; }
  [[nodiscard]] Time deadline() const;  ///< the earliest of the socket, the deferred reply and the next heartbeat
  [[nodiscard]] std::uint32_t events() const;  ///< to register with epoll

  void start_stream(std::string text, std::shared_ptr<BodyStream> body, Time now);
  /// Sends new output of the stream. None is taken before the socket has accepted the previous chunk: a slow client
  /// keeps one chunk here, and the producer bounds the rest.
  void feed_stream(Time now);
  void send_heartbeat(Time now);
  void end_stream(Time now);

  std::uint64_t number;
  Connection connection;
  std::shared_ptr<PendingRequest> pending;  ///< the request that a handler processes or that is deferred; null: none
  bool notified = false;                    ///< a notification came before the reply was known to be deferred
  std::function<void()> stop_watching;      ///< set while the reply is deferred
  std::shared_ptr<BodyStream> stream;       ///< the body of the reply, if it is streamed
  Time heartbeat_due{};                     ///< while there is a stream
  std::uint32_t registered_events = 0;      ///< with epoll
  Time timer = Time::max();                 ///< the earliest timer that is set
};

/// All connected clients.
class ClientTable {
 public:
  explicit ClientTable(const HttpServerSettings& settings) : settings_(settings) {}

  [[nodiscard]] bool has_capacity(const std::string& remote) const {
    const auto same_address = per_address_.find(remote);
    const std::size_t count = same_address == per_address_.end() ? 0 : same_address->second;
    return clients_.size() < settings_.connections_max && count < settings_.connections_per_address_max;
  }

  Client& add(std::unique_ptr<Client> client) {
    ++per_address_[client->connection.remote()];
    return *(clients_[client->number] = std::move(client));
  }

  void remove(const Client& client) {
    const auto same_address = per_address_.find(client.connection.remote());
    if (--same_address->second == 0) per_address_.erase(same_address);
    clients_.erase(client.number);
  }

  [[nodiscard]] Client* find(std::uint64_t number) const {
    const auto found = clients_.find(number);
    return found == clients_.end() ? nullptr : found->second.get();
  }

  [[nodiscard]] std::size_t size() const { return clients_.size(); }

  [[nodiscard]] std::vector<std::uint64_t> numbers() const {
    std::vector<std::uint64_t> numbers;
    numbers.reserve(clients_.size());
    for (const auto& [number, client] : clients_) numbers.push_back(number);
    return numbers;
  }

 private:
  const HttpServerSettings& settings_;
  std::unordered_map<std::uint64_t, std::unique_ptr<Client>> clients_;  ///< by number
  std::unordered_map<std::string, std::size_t> per_address_;
};

}  // namespace http
