#include "server/http/event_loop.h"

#include <sys/epoll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>

namespace http {
namespace {

constexpr std::uint64_t listener_number = 0, mailbox_number = 1;
constexpr int accepts_per_turn = 64;  // a flood of clients must not keep the served ones waiting

void watch(int epoll, int operation, int fd, std::uint32_t events, std::uint64_t number) {
  epoll_event event{};
  event.events = events;
  event.data.u64 = number;
  if (::epoll_ctl(epoll, operation, fd, &event) != 0) throw std::system_error(errno, std::generic_category(), "epoll");
}

}  // namespace

HttpServer::Loop::Loop(const GateSettings& settings, const std::vector<Route>& routes,
                       std::function<std::string()> new_request_id, const telemetry::Log& log)
    : settings_(settings),
      new_request_id_(std::move(new_request_id)),
      log_(log),
      listener_(settings.host, settings.port),
      port_(listener_.port()),
      epoll_(::epoll_create1(EPOLL_CLOEXEC)),
      last_number_(mailbox_number),
      now_(std::chrono::steady_clock::now()) {
  if (epoll_ < 0) throw std::system_error(errno, std::generic_category(), "epoll");
  budget_.directory = settings.spool_directory;
  budget_.file_bytes = settings.spool_bytes;
  watch(epoll_, EPOLL_CTL_ADD, listener_.fd(), EPOLLIN, listener_number);
  watch(epoll_, EPOLL_CTL_ADD, mailbox_->fd(), EPOLLIN, mailbox_number);
  pool_.emplace(settings.handler_threads, settings.waiting_max, routes, log);
  thread_ = std::thread([this] { run(); });
}

HttpServer::Loop::~Loop() {
  stopping_ = true;
  mailbox_->interrupt();
  thread_.join();
  pool_.reset();  // what handlers still say is of no interest
  for (Message& message : mailbox_->take()) {
    if (auto* waiting = std::get_if<Waiting>(&message)) waiting->stop_watching();
  }
  for (const auto& [number, client] : clients_) {
    if (client->stop_watching) client->stop_watching();
  }
  clients_.clear();
  ::close(epoll_);
}

void HttpServer::Loop::drain(std::chrono::milliseconds grace) {
  draining_ = true;
  mailbox_->post(Drain{});
  std::unique_lock lock(drained_mutex_);
  drained_.wait_for(lock, grace, [&] { return empty_; });
}

void HttpServer::Loop::run() {
  std::array<epoll_event, 256> events{};
  while (!stopping_) {
    const int count =
        ::epoll_wait(epoll_, events.data(), static_cast<int>(events.size()), milliseconds_to_next_timer());
    now_ = std::chrono::steady_clock::now();
    for (int i = 0; i < count; ++i) {
      const epoll_event& event = events[static_cast<std::size_t>(i)];
      if (event.data.u64 == listener_number) {
        accept_clients();
      } else if (event.data.u64 == mailbox_number) {
        take_messages();
      } else {
        with_client(event.data.u64, [&](Client& client) { handle_event(client, event.events); });
      }
    }
    fire_timers();
    if (draining_ && clients_.empty() && listener_.fd() < 0) {
      const std::lock_guard lock(drained_mutex_);
      empty_ = true;
      drained_.notify_all();
    }
  }
}

/// Memory or the kernel may refuse anything: that costs the client it happened to, and nobody else.
void HttpServer::Loop::with_client(std::uint64_t number, const std::function<void(Client&)>& action) {
  Client* client = find(number);
  if (client == nullptr) return;
  try {
    action(*client);
  } catch (const std::exception& exception) {
    log_.write(telemetry::Level::error, "connection_failure", {{"detail", std::string_view(exception.what())}});
    client = find(number);
    if (client == nullptr) return;
    client->connection.close();
    drop(*client);
  }
}

int HttpServer::Loop::milliseconds_to_next_timer() const {
  if (timers_.empty()) return -1;
  const auto left = timers_.top().first - std::chrono::steady_clock::now();
  const auto whole = std::chrono::ceil<std::chrono::milliseconds>(left).count();
  return static_cast<int>(std::clamp<std::int64_t>(whole, 0, 60'000));
}

void HttpServer::Loop::accept_clients() {
  for (int i = 0; i < accepts_per_turn && listener_.fd() >= 0; ++i) {
    bool exhausted = false;
    auto accepted = listener_.accept(exhausted);
    if (exhausted && now_ - exhaustion_told_ > std::chrono::seconds(1)) {
      exhaustion_told_ = now_;
      log_.write(telemetry::Level::warning, "descriptors_exhausted",
                 {{"connections", static_cast<std::int64_t>(clients_.size())}});
    }
    if (!accepted) return;
    const auto neighbours = clients_of_.find(accepted->remote);
    const std::size_t neighbour_count = neighbours == clients_of_.end() ? 0 : neighbours->second;
    if (clients_.size() >= settings_.connections_max || neighbour_count >= settings_.connections_per_address_max) {
      reject_connection(std::move(*accepted));
      continue;
    }
    ++clients_of_[accepted->remote];
    const std::uint64_t number = ++last_number_;
    clients_.emplace(number, std::make_unique<Client>(number, std::move(*accepted), settings_, budget_, now_));
    connections_ = clients_.size();
    with_client(number, [this](Client& client) {
      client.interest = EPOLLIN;
      watch(epoll_, EPOLL_CTL_ADD, client.connection.fd(), EPOLLIN, client.number);
      arm_timer(client);
    });
  }
}

/// Tells a client that there are too many, as far as its socket takes it at once.
void HttpServer::Loop::reject_connection(Listener::Accepted accepted) {
  Client client(0, std::move(accepted), settings_, budget_, now_);
  client.connection.refuse({Failure::too_many_connections,
                            "the limits are connections " + std::to_string(settings_.connections_max) +
                                " and connections_per_address " + std::to_string(settings_.connections_per_address_max),
                            {}});
  refuse(client);
}

HttpServer::Loop::Client* HttpServer::Loop::find(std::uint64_t number) {
  const auto found = clients_.find(number);
  return found == clients_.end() ? nullptr : found->second.get();
}

void HttpServer::Loop::handle_event(Client& client, std::uint32_t events) {
  Connection& connection = client.connection;
  const bool gone = (events & (EPOLLERR | EPOLLHUP)) != 0;
  const bool left_while_waiting = (events & EPOLLRDHUP) != 0 && (client.stop_watching || client.stream);
  if (gone || left_while_waiting) connection.close();
  if ((events & EPOLLIN) != 0 && connection.wants_to_read()) connection.receive(now_);
  if ((events & EPOLLOUT) != 0 && connection.wants_to_write()) connection.send(now_);
  if (client.stream) feed_stream(client);
  update_variances(client);
}

Time HttpServer::Loop::deadline_of(const Client& client) {
  const Time socket = client.connection.deadline();
  if (client.stream) return std::min(socket, client.sign_of_life_due);
  return client.stop_watching ? std::min(socket, client.exchange->parked.deadline) : socket;
}

void HttpServer::Loop::arm_timer(Client& client) {
  const Time deadline = deadline_of(client);
  if (deadline >= client.armed) return;  // the earlier timer will look again
  client.armed = deadline;
  timers_.emplace(deadline, client.number);
}

void HttpServer::Loop::fire_timers() {
  while (!timers_.empty() && timers_.top().first <= now_) {
    const auto [when, number] = timers_.top();
    timers_.pop();
    with_client(number, [&, fired = when](Client& client) {
      if (client.armed == fired) fire_timer(client);
    });
  }
}

void HttpServer::Loop::fire_timer(Client& client) {
  client.armed = Time::max();
  if (deadline_of(client) > now_) return arm_timer(client);
  if (client.stop_watching) {
    resume(client, true);
  } else if (client.connection.deadline() <= now_) {
    client.connection.expire();
  } else {
    client.sign_of_life_due = now_ + client.stream->quiet;
    if (!client.connection.wants_to_write()) client.connection.append(client.stream->sign_of_life, now_);
  }
  update_variances(client);
}

void HttpServer::Loop::update_variances(Client& client) {
  Connection& connection = client.connection;
  for (;;) {
    connection.proceed(now_);
    if (connection.refusal) {
      refuse(client);
    } else if (connection.request) {
      dispatch(client);
    } else {
      break;
    }
  }
  if (draining_ && listener_.fd() < 0 && connection.is_idle()) connection.close();
  if (connection.state() == Connection::State::closed) return drop(client);
  watch_socket(client);
  arm_timer(client);
}

void HttpServer::Loop::watch_socket(Client& client) {
  std::uint32_t interest = 0;
  if (client.connection.wants_to_read()) interest |= EPOLLIN;
  if (client.connection.wants_to_write()) interest |= EPOLLOUT;
  if (client.stop_watching || client.stream)
    interest |= EPOLLRDHUP;  // someone who waits tells by it that they wait no longer
  if (interest == client.interest) return;
  client.interest = interest;
  watch(epoll_, EPOLL_CTL_MOD, client.connection.fd(), interest, client.number);
}

void HttpServer::Loop::drop(Client& client) {
  if (client.stop_watching) client.stop_watching();
  const auto address = clients_of_.find(client.connection.remote());
  if (--address->second == 0) clients_of_.erase(address);
  clients_.erase(client.number);  // the closed socket has left epoll by itself
  connections_ = clients_.size();
}

}  // namespace http
