#include "server/storage/postgres/postgres_wakeups.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <mutex>
#include <set>
#include <system_error>
#include <thread>
#include <utility>

#include "server/storage/postgres/postgres_database.h"
#include "server/support/descriptor.h"
#include "server/support/locked.h"

namespace storage::postgres {
namespace {

constexpr std::size_t payload_max = 7900;    // NOTIFY has at most 7999 bytes
constexpr std::size_t pending_max = 10'000;  // without a connection; receivers look into the tables anyway
constexpr int pause_after_failure_ms = 300;

class PostgresWakeups final : public queue::Wakeups {
 public:
  explicit PostgresWakeups(std::string dsn) : dsn_(std::move(dsn)), signal_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    if (!signal_) throw std::system_error(errno, std::generic_category(), "eventfd");
    thread_ = std::thread([this] { run(); });
  }

  ~PostgresWakeups() override {
    support::locked(pending_mutex_, [&] { stopping_ = true; });
    ::eventfd_write(signal_.get(), 1);
    thread_.join();
  }

  void publish(std::string_view topic, std::string_view id) noexcept override {
    try {
      std::string line(topic);
      line.append(" ").append(id);
      const std::lock_guard lock(pending_mutex_);
      if (pending_.size() < pending_max) pending_.insert(std::move(line));
    } catch (const std::bad_alloc&) {
      return;  // it is a hint
    }
    ::eventfd_write(signal_.get(), 1);
  }

  std::shared_ptr<void> subscribe(std::string topic, Receive receive) override {
    const std::lock_guard lock(receivers_mutex_);
    const std::uint64_t number = ++last_receiver_;
    receivers_.emplace(std::move(topic), std::pair(number, std::move(receive)));
    const auto end = [this, number](void*) {
      const std::lock_guard ending(receivers_mutex_);
      std::erase_if(receivers_, [&](const auto& entry) { return entry.second.first == number; });
    };
    return {static_cast<void*>(this), end};
  }

 private:
  void run() {
    for (;;) {
      const Connection connection = listen();
      if (connection != nullptr) {
        report_loss();
        exchange(connection.get());
      } else {
        wait(-1, pause_after_failure_ms);
      }
      const std::lock_guard lock(pending_mutex_);
      if (stopping_) return;
    }
  }

  /// Null if the server cannot be reached.
  Connection listen() {
    Connection connection = connect(dsn_);
    if (connection == nullptr || PQstatus(connection.get()) != CONNECTION_OK) return nullptr;
    const Result result(PQexec(connection.get(), "SET tcp_user_timeout = 7000; LISTEN whittle"));
    return PQresultStatus(result.get()) == PGRES_COMMAND_OK ? std::move(connection) : nullptr;
  }

  /// Returns when the connection is lost, or at the end.
  void exchange(PGconn* connection) {
    for (;;) {
      if (!send_pending(connection)) return;
      if (PQconsumeInput(connection) != 1) return;
      for (;;) {
        const std::unique_ptr<PGnotify, decltype(&PQfreemem)> message(PQnotifies(connection), &PQfreemem);
        if (message == nullptr) break;
        if (message->be_pid != PQbackendPID(connection)) receive(message->extra);
      }
      wait(PQsocket(connection), -1);
      const std::lock_guard lock(pending_mutex_);
      if (stopping_ && pending_.empty()) return;
    }
  }

  bool send_pending(PGconn* connection) {
    const auto lines = support::locked(pending_mutex_, [&] { return std::exchange(pending_, {}); });
    std::string payload;
    const auto send = [&] {
      const std::array<const char*, 1> values{payload.c_str()};
      const Result result(
          PQexecParams(connection, "SELECT pg_notify('whittle', $1)", 1, nullptr, values.data(), nullptr, nullptr, 0));
      payload.clear();
      return PQresultStatus(result.get()) == PGRES_TUPLES_OK;
    };
    for (const std::string& line : lines) {
      if (!payload.empty() && payload.size() + line.size() + 1 > payload_max && !send()) return false;
      payload.append(line).append("\n");
    }
    return payload.empty() || send();
  }

  void receive(const std::string& payload) {
    const std::lock_guard lock(receivers_mutex_);
    for (std::size_t begin = 0; begin < payload.size();) {
      const std::size_t end = std::min(payload.find('\n', begin), payload.size());
      const std::string_view line = std::string_view(payload).substr(begin, end - begin);
      const std::size_t blank = std::min(line.find(' '), line.size());
      const auto [first, last] = receivers_.equal_range(line.substr(0, blank));
      const std::string id(line.substr(std::min(blank + 1, line.size())));
      std::for_each(first, last, [&](const auto& entry) { entry.second.second(id); });
      begin = end + 1;
    }
  }

  void report_loss() {
    const std::lock_guard lock(receivers_mutex_);
    for (const auto& [topic, receiver] : receivers_) receiver.second("");
  }

  /// Until the socket (-1: none) is readable, `publish` was called, or `timeout_ms` (-1: none) have passed.
  void wait(int socket, int timeout_ms) const {
    std::array<pollfd, 2> sources{pollfd{signal_.get(), POLLIN, 0}, pollfd{socket, POLLIN, 0}};
    ::poll(sources.data(), sources.size(), timeout_ms);
    eventfd_t count = 0;
    ::eventfd_read(signal_.get(), &count);
  }

  const std::string dsn_;
  const support::Descriptor signal_;  ///< an eventfd: messages to send, or the end
  std::mutex pending_mutex_;
  std::set<std::string> pending_;  ///< lines: topic, blank, id
  bool stopping_ = false;
  std::mutex receivers_mutex_;                                                            ///< held while one is called
  std::multimap<std::string, std::pair<std::uint64_t, Receive>, std::less<>> receivers_;  ///< by topic
  std::uint64_t last_receiver_ = 0;
  std::thread thread_;  ///< last: it uses all other members
};

}  // namespace

std::unique_ptr<queue::Wakeups> make_wakeups(const std::string& dsn) { return std::make_unique<PostgresWakeups>(dsn); }

}  // namespace storage::postgres
