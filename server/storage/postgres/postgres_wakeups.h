#pragma once
/// Messages between nodes by NOTIFY. Private to this directory.

#include <libpq-fe.h>

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <utility>

#include "server/queue/wakeups.h"
#include "server/support/descriptor.h"

namespace storage::postgres {

/// One connection that listens and sends. It must not pass a proxy that pools transactions. A NOTIFY makes transactions
/// commit one after the other, so messages are never part of the transactions of the stores: they are sent after these,
/// those of some milliseconds together, in one that writes nothing.
class PostgresWakeups final : public queue::Wakeups {
 public:
  explicit PostgresWakeups(std::string dsn);
  ~PostgresWakeups() override;

  void publish(std::string_view topic, std::string_view id) noexcept override;
  std::shared_ptr<void> subscribe(std::string topic, Receive receive) override;

 private:
  struct Finish {
    void operator()(PGconn* connection) const { PQfinish(connection); }
  };
  using Connection = std::unique_ptr<PGconn, Finish>;

  void run();
  Connection listen();
  void exchange(PGconn* connection);
  bool send_pending(PGconn* connection);
  void receive(const std::string& payload);
  void report_loss();
  void wait(int socket, int timeout_ms) const;

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

}  // namespace storage::postgres
