#pragma once
/// A connected client with the request and the reply that are in progress, and the table of all clients. Used by the
/// event loop's thread only.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "server/http/connection.h"
#include "server/http/listener.h"
#include "server/http/pending_request.h"

namespace http {

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

class ClientTable {
 public:
  explicit ClientTable(const HttpServerSettings& settings) : settings_(settings) {}

  [[nodiscard]] bool has_capacity(const std::string& remote) const;
  Client& add(std::unique_ptr<Client> client);
  void remove(const Client& client);
  [[nodiscard]] Client* find(std::uint64_t number) const;
  [[nodiscard]] std::size_t size() const { return clients_.size(); }
  [[nodiscard]] std::vector<std::uint64_t> numbers() const;

 private:
  const HttpServerSettings& settings_;
  std::unordered_map<std::uint64_t, std::unique_ptr<Client>> clients_;  ///< by number
  std::unordered_map<std::string, std::size_t> per_address_;
};

}  // namespace http
