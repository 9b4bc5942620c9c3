#pragma once
/// The gate's insides: clients, their timers, and what happens to a request between socket and handler.

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <queue>
#include <thread>
#include <unordered_map>

#include "server/http/handler_pool.h"
#include "server/http/http_mailbox.h"
#include "server/http/http_server.h"
#include "server/http/listener.h"

namespace http {

class HttpServer::Loop {
 public:
  Loop(const GateSettings& settings, const std::vector<Route>& routes, std::function<std::string()> new_request_id,
       const telemetry::Log& log);
  ~Loop();

  [[nodiscard]] std::uint16_t port() const { return port_; }
  [[nodiscard]] std::size_t connections() const { return connections_; }
  void drain(std::chrono::milliseconds grace);

 private:
  /// A connection, and the request of it that is being answered.
  struct Client {
    Client(std::uint64_t unique_number, Listener::Accepted accepted, const GateSettings& settings, BodyBudget& budget,
           Time now)
        : number(unique_number),
          connection(accepted.fd, std::move(accepted.remote), settings.head, settings.judge, settings.times, budget,
                     now) {}
    std::uint64_t number;
    Connection connection;
    std::shared_ptr<PendingRequest> exchange;  ///< the request that handlers or waiting have; null: none
    bool woken = false;                        ///< a wake came before the request was told to be waiting
    std::function<void()> stop_watching;       ///< set while the request waits without a thread
    std::shared_ptr<BodyStream> stream;        ///< of the reply that is being streamed
    Time sign_of_life_due{};                   ///< while there is a stream
    std::uint32_t interest = 0;                ///< of epoll
    Time armed = Time::max();                  ///< the earliest timer that is set
  };

  void run();
  int milliseconds_to_next_timer() const;
  void accept_clients();
  void reject_connection(Listener::Accepted accepted);
  void with_client(std::uint64_t number, const std::function<void(Client&)>& action);
  void handle_event(Client& client, std::uint32_t events);
  void fire_timers();
  void fire_timer(Client& client);

  void take_messages();
  void receive(Finished& finished);
  void receive(Waiting& waiting);
  void receive(Wake& wake);
  void receive(Drain&);

  /// After anything happened to a client: dispatches or refuses what it sent, then drops it or waits for more.
  void update_variances(Client& client);
  void refuse(Client& client);
  void dispatch(Client& client);
  void resume(Client& client, bool timed_out);
  void start_stream(Client& client, Finished& finished);
  void feed_stream(Client& client);
  void end_stream(Client& client);
  void watch_socket(Client& client);
  void arm_timer(Client& client);
  void drop(Client& client);
  [[nodiscard]] Client* find(std::uint64_t number);
  [[nodiscard]] static Time deadline_of(const Client& client);

  const GateSettings settings_;
  const std::function<std::string()> new_request_id_;
  const telemetry::Log log_;
  BodyBudget budget_;
  Listener listener_;
  const std::uint16_t port_;
  const std::shared_ptr<Mailbox> mailbox_ = std::make_shared<Mailbox>();
  int epoll_ = -1;

  std::unordered_map<std::uint64_t, std::unique_ptr<Client>> clients_;  ///< by number
  std::unordered_map<std::string, std::size_t> clients_of_;             ///< by address
  std::uint64_t last_number_;
  using Timer = std::pair<Time, std::uint64_t>;  ///< when to look at which client
  std::priority_queue<Timer, std::vector<Timer>, std::greater<>> timers_;
  Time now_;
  Time exhaustion_told_{};  ///< running out of descriptors is logged at most once a second

  std::atomic<std::size_t> connections_ = 0;  ///< clients_.size(), for others
  std::atomic<bool> draining_ = false;        ///< read by handler threads: replies close then
  std::atomic<bool> stopping_ = false;
  std::mutex drained_mutex_;
  std::condition_variable drained_;
  bool empty_ = false;  ///< draining, and no client is left

  std::optional<HandlerPool> pool_;
  std::thread thread_;
};

}  // namespace http
