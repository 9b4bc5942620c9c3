#include "server/http/http_server.h"

#include <sys/epoll.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <csignal>
#include <mutex>
#include <queue>
#include <system_error>
#include <thread>
#include <utility>

#include "server/http/connection.h"
#include "server/http/listener.h"
#include "server/http/request_dispatcher.h"

namespace http {
namespace {

constexpr std::uint64_t listener_number = 0, queue_number = 1;  // clients have greater numbers
constexpr int accepts_per_turn = 64;  // limits the time in which connected clients are not served

}  // namespace

/// Deadlines of clients, ordered by time. A client whose deadline moves has several timers; their receiver ignores
/// those that it replaced.
class TimerQueue {
 public:
  using Timer = std::pair<Time, std::uint64_t>;  ///< deadline and number of the client

  void add(Time deadline, std::uint64_t client) { timers_.emplace(deadline, client); }

  /// Removes and returns a timer whose deadline has passed.
  std::optional<Timer> take_due(Time now) {
    if (timers_.empty() || timers_.top().first > now) return std::nullopt;
    const Timer timer = timers_.top();
    timers_.pop();
    return timer;
  }

  /// Timeout for epoll_wait until the next deadline, at most a minute; -1 without timers.
  [[nodiscard]] int timeout_ms() const {
    if (timers_.empty()) return -1;
    const auto left = timers_.top().first - std::chrono::steady_clock::now();
    const auto left_ms = std::chrono::ceil<std::chrono::milliseconds>(left).count();
    return static_cast<int>(std::clamp<std::int64_t>(left_ms, 0, 60'000));
  }

 private:
  std::priority_queue<Timer, std::vector<Timer>, std::greater<>> timers_;
};

/// Owns the sockets, reads requests, and writes replies.
class EventLoop {
 public:
  EventLoop(const HttpServerSettings& settings, std::vector<Route> routes, std::function<std::string()> new_request_id,
            const telemetry::Log& log)
      : settings_(settings),
        log_(log),
        listener_(settings.host, settings.port, settings.descriptors_kept),
        epoll_(::epoll_create1(EPOLL_CLOEXEC)),
        last_number_(queue_number),
        now_(std::chrono::steady_clock::now()) {
    if (!epoll_) throw std::system_error(errno, std::generic_category(), "epoll");
    budget_.directory = settings.spool_directory;
    budget_.file_bytes = settings.spool_bytes;
    dispatcher_.emplace(settings_, std::move(routes), std::move(new_request_id), log, events_);
    register_socket(EPOLL_CTL_ADD, listener_.fd(), EPOLLIN, listener_number);
    register_socket(EPOLL_CTL_ADD, events_->descriptor(), EPOLLIN, queue_number);
    thread_ = std::thread([this] { run(); });
  }

  ~EventLoop() {
    stopping_ = true;
    events_->interrupt();
    thread_.join();
    dispatcher_.reset();  // joins the handler threads
    for (ServerEvent& event : events_->take()) {
      if (auto* deferred = std::get_if<ReplyDeferred>(&event)) deferred->stop_watching();
    }
    for (const std::uint64_t number : clients_.numbers()) remove(*clients_.find(number));
  }

  [[nodiscard]] std::uint16_t port() const { return listener_.port(); }
  [[nodiscard]] std::size_t connections() const { return connections_; }

  void check_access() { events_->post(AccessCheck{}); }

  void drain(std::chrono::milliseconds grace) {
    dispatcher_->begin_drain();
    events_->post(DrainRequest{});
    std::unique_lock lock(drained_mutex_);
    drained_changed_.wait_for(lock, grace, [&] { return drained_; });
  }

 private:
  void run() {
    std::array<epoll_event, 256> events{};
    while (!stopping_) {
      const int count =
          ::epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()), timers_.timeout_ms());
      now_ = std::chrono::steady_clock::now();
      for (int i = 0; i < count; ++i) {
        const epoll_event& event = events[static_cast<std::size_t>(i)];
        if (event.data.u64 == listener_number) {
          accept_clients();
        } else if (event.data.u64 == queue_number) {
          take_events();
        } else {
          with_client(event.data.u64, [&](Client& client) { on_socket_event(client, event.events); });
        }
      }
      fire_timers();
      if (listener_.fd() < 0 && clients_.size() == 0) {
        const std::lock_guard lock(drained_mutex_);
        drained_ = true;
        drained_changed_.notify_all();
      }
    }
  }

  void register_socket(int operation, int fd, std::uint32_t events, std::uint64_t number) const {
    epoll_event event{};
    event.events = events;
    event.data.u64 = number;
    if (::epoll_ctl(epoll_.get(), operation, fd, &event) == 0) return;
    throw std::system_error(errno, std::generic_category(), "epoll");
  }

  void accept_clients() {
    for (int i = 0; i < accepts_per_turn && listener_.fd() >= 0; ++i) {
      bool exhausted = false;
      auto accepted = listener_.accept(exhausted);
      if (exhausted && now_ - exhaustion_logged_ > std::chrono::seconds(1)) {
        exhaustion_logged_ = now_;
        log_.write(telemetry::Level::warning, "descriptors_exhausted",
                   {{"connections", static_cast<std::int64_t>(clients_.size())}});
      }
      if (!accepted) return;
      if (!clients_.has_capacity(accepted->remote)) {
        reject_connection(std::move(*accepted));
        continue;
      }
      const std::uint64_t number = ++last_number_;
      clients_.add(std::make_unique<Client>(number, std::move(*accepted), settings_, budget_, now_));
      connections_ = clients_.size();
      with_client(number, [this](Client& client) {
        client.registered_events = EPOLLIN;
        register_socket(EPOLL_CTL_ADD, client.connection.fd(), EPOLLIN, client.number);
        set_timer(client);
      });
    }
  }

  /// Answers 503 as far as the socket accepts it at once.
  void reject_connection(Listener::Accepted accepted) {
    Client client(0, std::move(accepted), settings_, budget_, now_);
    client.connection.refuse(
        {failures::too_many_connections, "the limits are connections " + std::to_string(settings_.connections_max) +
                                             " and connections_per_address " +
                                             std::to_string(settings_.connections_per_address_max)});
    dispatcher_->refuse(client, now_);
  }

  /// Memory and the kernel can fail anywhere. The failure ends the connection of the client that it occurred for.
  void with_client(std::uint64_t number, const std::function<void(Client&)>& action) {
    Client* client = clients_.find(number);
    if (client == nullptr) return;
    try {
      action(*client);
    } catch (const std::exception& exception) {
      log_.write(telemetry::Level::error, "connection_failure", {{"detail", std::string_view(exception.what())}});
      client = clients_.find(number);
      if (client != nullptr) remove(*client);
    }
  }

  void on_socket_event(Client& client, std::uint32_t events) {
    Connection& connection = client.connection;
    const bool failed = (events & (EPOLLERR | EPOLLHUP)) != 0;
    const bool left = (events & EPOLLRDHUP) != 0 && client.is_waiting();
    if (failed || left) connection.close();
    if ((events & EPOLLIN) != 0 && connection.needs_input()) connection.receive(now_);
    if ((events & EPOLLOUT) != 0 && connection.has_output()) connection.send(now_);
    client.feed_stream(now_);
    advance(client);
  }

  void fire_timers() {
    while (const auto timer = timers_.take_due(now_)) {
      with_client(timer->second, [&](Client& client) {
        if (client.timer == timer->first) on_timer(client);
      });
    }
  }

  void on_timer(Client& client) {
    client.timer = Time::max();
    if (client.deadline() > now_) return set_timer(client);
    if (client.is_deferred()) {
      dispatcher_->resume(client, true);
    } else if (client.connection.deadline() <= now_) {
      client.connection.expire();
    } else {
      client.send_heartbeat(now_);
    }
    advance(client);
  }

  void take_events() {
    for (ServerEvent& event : events_->take()) {
      std::visit([this](auto& content) { on_event(content); }, event);
    }
  }

  void on_event(ReplyReady& ready) {
    with_client(ready.pending->client, [&](Client& client) {
      dispatcher_->start_reply(client, ready, now_);
      end_without_access(client);  // it may have lost it since the handler began
      advance(client);
    });
  }

  void on_event(ReplyDeferred& deferred) {
    if (clients_.find(deferred.pending->client) == nullptr) {  // disconnected meanwhile
      deferred.stop_watching();
      return dispatcher_->abandon(deferred.pending);
    }
    with_client(deferred.pending->client, [&](Client& client) {
      dispatcher_->on_deferred(client, std::move(deferred.stop_watching));
      end_without_access(client);
      advance(client);
    });
  }

  void on_event(BodyPartRead& part) {
    with_client(part.client, [&](Client& client) {
      client.connection.add_body_part(std::move(part.bytes), now_);
      advance(client);
    });
  }

  void on_event(AccessCheck&) {
    for (const std::uint64_t number : clients_.numbers()) {
      with_client(number, [this](Client& client) {
        client.connection.check_access();
        end_without_access(client);
        advance(client);
      });
    }
  }

  void end_without_access(Client& client) {
    if (!settings_.access || !client.is_waiting() || client.pending == nullptr) return;
    const auto key = settings_.access(client.pending->request.head);
    const auto problem = key ? scope_problem(*key, *client.pending->route) : std::optional(key.error());
    if (!problem) return;
    if (client.stream) return client.end_stream(now_);
    dispatcher_->refuse_deferred(client, *problem, now_);
  }

  void on_event(Notification& notification) {
    with_client(notification.client, [&](Client& client) {
      if (dispatcher_->on_notification(client, notification, now_)) advance(client);
    });
  }

  void on_event(DrainRequest&) {
    listener_.close();
    for (const std::uint64_t number : clients_.numbers()) {
      with_client(number, [this](Client& client) {
        if (client.is_deferred()) dispatcher_->resume(client, true);
        if (client.stream) client.end_stream(now_);
        advance(client);
      });
    }
  }

  /// After any event of a client: dispatches or refuses its requests, then removes it or waits for its next event.
  void advance(Client& client) {
    Connection& connection = client.connection;
    for (;;) {
      connection.proceed(now_);
      if (connection.refusal) {
        dispatcher_->refuse(client, now_);
      } else if (connection.request) {
        dispatcher_->dispatch(client, now_);
      } else {
        break;
      }
    }
    dispatcher_->read_body(client, now_);
    if (listener_.fd() < 0 && connection.is_idle()) connection.close();  // draining
    if (connection.state() == Connection::State::closed) return remove(client);
    if (const std::uint32_t events = client.events(); events != client.registered_events) {
      client.registered_events = events;
      register_socket(EPOLL_CTL_MOD, connection.fd(), events, client.number);
    }
    set_timer(client);
  }

  void set_timer(Client& client) {
    const Time deadline = client.deadline();
    if (deadline >= client.timer) return;  // the earlier timer sets the next one
    client.timer = deadline;
    timers_.add(deadline, client.number);
  }

  void remove(Client& client) {
    if (client.stop_watching) {
      client.stop_watching();
      if (dispatcher_) dispatcher_->abandon(client.pending);
    }
    clients_.remove(client);  // the closed socket leaves epoll by itself
    connections_ = clients_.size();
  }

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

HttpServer::HttpServer(const HttpServerSettings& settings, std::vector<Route> routes,
                       std::function<std::string()> new_request_id, const telemetry::Log& log) {
  std::signal(SIGPIPE, SIG_IGN);  // writing to a disconnected client returns an error code
  loop_ = std::make_unique<EventLoop>(settings, std::move(routes), std::move(new_request_id), log);
}

HttpServer::~HttpServer() = default;

std::uint16_t HttpServer::port() const { return loop_->port(); }

std::size_t HttpServer::connections() const { return loop_->connections(); }

void HttpServer::check_access() { loop_->check_access(); }

void HttpServer::drain(std::chrono::milliseconds grace) { loop_->drain(grace); }

}  // namespace http
