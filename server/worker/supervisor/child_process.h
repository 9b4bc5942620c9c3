#pragma once
/// A child process of the daemon that is connected by a socket and inherits nothing else.

#include <sys/types.h>

#include <deque>
#include <string>
#include <vector>

#include "server/worker/protocol/protocol.h"
#include "server/worker/supervisor/output_reader.h"

namespace worker {

/// Used by one thread. The destructor kills and reaps the process.
class ChildProcess {
 public:
  /// Starts `executable` with a socket as descriptor 3, an empty standard input, its output connected to `output`, and
  /// without WHITTLE_* in its environment, which contains secrets of the daemon. It ignores SIGINT and SIGTERM: the
  /// daemon decides about its end. Throws std::system_error.
  explicit ChildProcess(const std::string& executable);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  [[nodiscard]] int pid() const { return pid_; }
  /// To be polled: POLLIN always, POLLOUT while has_unsent().
  [[nodiscard]] int socket() const { return socket_.get(); }
  /// To be polled: POLLIN after the exit of the process.
  [[nodiscard]] int pid_descriptor() const { return pid_descriptor_.get(); }

  /// Never blocks: later calls of flush send what the socket does not accept now.
  void send(Packet packet);
  void flush();
  [[nodiscard]] bool has_unsent() const { return !unsent_.empty(); }
  Received receive() { return worker::receive(socket_.get(), worker_body_limit); }

  [[nodiscard]] OutputReader& output() { return output_; }

  void kill();
  /// Waits for the exit and returns its reason: "was killed by signal 11 (SIGSEGV)", "exited with status 1".
  std::string reap();

 private:
  support::Descriptor socket_;
  OutputReader output_{support::Descriptor()};
  support::Descriptor pid_descriptor_;
  pid_t pid_ = 0;
  bool reaped_ = false;
  std::deque<Packet> unsent_;
};

}  // namespace worker
