#pragma once
/// A child process of the daemon that is connected by a socket and inherits nothing else, and its output.

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "server/support/descriptor.h"
#include "server/worker/protocol/protocol.h"

namespace worker {

/// Reads the standard output and error of a worker process, such as warnings of libraries and reports of sanitizers.
/// The text is untrusted, so its length and number of lines are limited before it is logged. Used by one thread.
class OutputReader {
 public:
  using Time = std::chrono::steady_clock::time_point;
  /// Receives a line without its end, and the number of lines omitted since the last one.
  using OnLine = std::function<void(const std::string& text, std::uint64_t omitted_lines)>;

  static constexpr std::size_t line_bytes = 1024;  ///< longer lines are truncated
  /// The report of a sanitizer has 100 lines; a library that warns for each row of an image writes thousands.
  static constexpr int lines_per_period = 200;
  static constexpr std::chrono::seconds period{60};

  /// `pipe` is the reading end of a non-blocking pipe.
  explicit OutputReader(support::Descriptor pipe) : pipe_(std::move(pipe)) {}

  /// To be polled for POLLIN; -1 after the end of the pipe.
  [[nodiscard]] int descriptor() const { return pipe_.get(); }

  /// Reads the available output, at most two full pipes, and passes on complete lines; at the end of the pipe also the
  /// last one.
  void read(Time now, const OnLine& on_line);

 private:
  void add(std::string_view bytes, Time now, const OnLine& on_line);
  void end_line(Time now, const OnLine& on_line);

  support::Descriptor pipe_;
  std::string line_;  ///< beginning of the next line
  Time period_end_{};
  int left_in_period_ = 0;
  std::uint64_t omitted_lines_ = 0;
};

/// Used by one thread. The destructor kills and reaps the process.
class ChildProcess {
 public:
  /// Starts `executable` with a socket as descriptor 3, an empty standard input, its output connected to `output`, and
  /// without WHITTLE_* in its environment, which contains secrets of the daemon. It ignores SIGINT and SIGTERM: the
  /// daemon decides about its end. Throws std::system_error.
  explicit ChildProcess(const std::string& executable);
  ~ChildProcess();
  ChildProcess(ChildProcess&&) = delete;

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
