#pragma once
/// The event loop of the HTTP server: owns the sockets, reads requests, and writes replies.

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "server/http/client.h"
#include "server/http/listener.h"
#include "server/http/request_dispatcher.h"
#include "server/http/timer_queue.h"

namespace http {

class EventLoop {
 public:
  EventLoop(const HttpServerSettings& settings, std::vector<Route> routes, std::function<std::string()> new_request_id,
            const telemetry::Log& log);
  ~EventLoop();

  [[nodiscard]] std::uint16_t port() const { return listener_.port(); }
  [[nodiscard]] std::size_t connections() const { return connections_; }
  void drain(std::chrono::milliseconds grace);

 private:
  void run();
  void register_socket(int operation, int fd, std::uint32_t events, std::uint64_t number) const;
  void accept_clients();
  void reject_connection(Listener::Accepted accepted);
  void with_client(std::uint64_t number, const std::function<void(Client&)>& action);
  void on_socket_event(Client& client, std::uint32_t events);
  void fire_timers();
  void on_timer(Client& client);
  void take_events();
  void on_event(ReplyReady& ready);
  void on_event(ReplyDeferred& deferred);
  void on_event(Notification& notification);
  void on_event(DrainRequest&);
  /// After any event of a client: dispatches or refuses its requests, then removes it or waits for its next event.
  void advance(Client& client);
  void set_timer(Client& client);
  void remove(Client& client);

  const HttpServerSettings settings_;
  const telemetry::Log log_;
  BodyBudget budget_;
  Listener listener_;
  const support::Descriptor epoll_;
  TimerQueue timers_;
  ClientTable clients_{settings_};
  std::uint64_t last_number_;
  Time now_;
  Time exhaustion_logged_{};

  std::atomic<std::size_t> connections_ = 0;  ///< clients_.size(), for other threads
  std::atomic<bool> stopping_ = false;
  std::mutex drained_mutex_;
  std::condition_variable drained_changed_;
  bool drained_ = false;  ///< draining, and no client is left

  const std::shared_ptr<ServerEvents> events_ = std::make_shared<ServerEvents>();
  std::optional<RequestDispatcher> dispatcher_;
  std::thread thread_;
};

}  // namespace http
