#pragma once
/// The worker as a child process of the daemon: started with a socket and nothing else of ours, watched, ended.

#include <sys/types.h>

#include <deque>
#include <string>
#include <vector>

#include "server/worker/protocol/sealed_memory.h"
#include "server/worker/protocol/protocol.h"
#include "server/worker/supervisor/output_reader.h"

namespace worker {

/// Used by one thread. The process is killed and reaped when this goes.
class Process {
 public:
  /// Starts `executable` with these arguments, the socket as descriptor 3, an empty standard input, what it says going
  /// to `spoken`, and without WHITTLE_* in its environment: the daemon's secrets are not its. SIGINT and SIGTERM
  /// do not reach it: the daemon decides. Throws std::system_error.
  Process(const std::string& executable, std::vector<std::string> arguments);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  [[nodiscard]] int pid() const { return pid_; }
  /// To be polled: POLLIN always, POLLOUT while has_unsent().
  [[nodiscard]] int socket() const { return socket_.get(); }
  /// To be polled: POLLIN when the process has ended.
  [[nodiscard]] int pid_descriptor() const { return pid_descriptor_.get(); }

  /// Never blocks: what the socket does not take now is sent by later calls of flush.
  void send(Packet packet);
  void flush();
  [[nodiscard]] bool has_unsent() const { return !unsent_.empty(); }
  Received receive() { return worker::receive(socket_.get(), worker_body_limit); }

  /// What it says on its standard output and error.
  [[nodiscard]] OutputReader& output() { return spoken_; }

  void kill();
  /// Waits for the process's end; says how it came: "was killed by signal 11 (SIGSEGV)", "exited with status 1".
  std::string reap();

 private:
  Descriptor socket_;
  OutputReader spoken_{Descriptor()};
  Descriptor pid_descriptor_;
  pid_t pid_ = 0;
  bool reaped_ = false;
  std::deque<Packet> unsent_;
};

}  // namespace worker
