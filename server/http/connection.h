#pragma once
/// One client's socket and the one request it is in: reads a checked request within limits and deadlines, later writes
/// the reply. It knows neither epoll nor handlers; the gate calls it from its one thread.
///
///   reading_head -> reading_body -> handling -> writing -> reading_head ... | lingering -> closed
///                                            -> streaming -> lingering -> closed
///
/// While a request is handled nothing more is read, so pipelined requests wait in the socket and are answered in order.

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "server/http/body.h"
#include "server/http/pending_request.h"
#include "server/http/request_head.h"

namespace http {

using Time = std::chrono::steady_clock::time_point;

/// How long a client may take. Each is a bound on what one client can hold, not a promise to be fast.
struct ConnectionTimes {
  std::chrono::milliseconds idle{75'000};        ///< without a request; longer than proxies keep theirs
  std::chrono::milliseconds head{10'000};        ///< from its first byte to its last
  std::chrono::milliseconds body_grace{10'000};  ///< what a body may take beyond its bytes at `bytes_per_s`
  std::chrono::milliseconds write_grace{30'000};
  std::chrono::milliseconds linger{2'000};  ///< for the client to read a refusal before its unread bytes reset it
  std::uint64_t bytes_per_s = 16u << 10;    ///< the least average rate of bodies and replies: a bad mobile line
};

/// What is wrong with a request whose head has come, its body not yet; asked from the loop, so it must be quick.
using HeadFilter = std::function<std::optional<Problem>(const RequestHead&)>;

class Connection {
 public:
  enum class State { reading_head, reading_body, handling, writing, streaming, lingering, closed };

  /// Owns `fd`, a connected non-blocking socket. The references must outlive it.
  Connection(int fd, std::string remote, const HeadLimits& limits, const HeadFilter& judge,
             const ConnectionTimes& times, BodyBudget& budget, Time now);
  Connection(const Connection&) = delete;
  ~Connection();

  [[nodiscard]] int fd() const { return fd_; }
  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] const std::string& remote() const { return remote_; }
  [[nodiscard]] Time deadline() const { return deadline_; }  ///< Time::max(): none
  [[nodiscard]] bool wants_to_read() const;
  [[nodiscard]] bool wants_to_write() const { return written_ < output_.size() || source_left() > 0; }
  /// Between requests, with nothing of the next one read.
  [[nodiscard]] bool is_idle() const { return state_ == State::reading_head && input_.empty(); }

  /// Reads what is there. Afterwards a request may be complete (state handling, `request` is set), refused (`refusal`
  /// is set; the gate replies and closes) or the connection closed.
  void receive(Time now);
  /// Reads a pipelined request from what is already here. Call when a reply has gone out.
  void proceed(Time now);

  std::optional<Request> request;  ///< complete, for the gate to take; its id is empty
  std::optional<Problem> refusal;  ///< for the gate to take and answer

  /// Starts the reply: `text` is head and body, `source` what follows.
  void reply(std::string text, std::optional<BodySource> source, bool keep_alive, Time now);
  /// Starts a reply whose body comes by `append` until `end_stream`. What is appended has to go out within the write
  /// grace.
  void start_stream(std::string text, Time now);
  void append(std::string text, Time now);
  void end_stream(Time now);
  /// Writes what the socket takes now. After the last byte: the next request, or the end.
  void send(Time now);

  /// Gives up on what is being read: sets `refusal`.
  void refuse(Problem problem);

  /// `deadline()` has passed.
  void expire();
  void close();

 private:
  void read_input(Time now);
  void start_body(RequestHead head, Time now);
  void fill_body();
  void finish_reply(Time now);
  void put(std::string text);
  [[nodiscard]] ssize_t send_bytes(std::string_view bytes) const;
  ssize_t send_piece_of_source();
  [[nodiscard]] std::uint64_t source_left() const { return source_ ? source_->size_bytes - source_written_ : 0; }
  [[nodiscard]] Time paced(Time start, std::chrono::milliseconds grace, std::uint64_t bytes) const;

  int fd_;
  State state_ = State::reading_head;
  std::string remote_;
  const HeadLimits& limits_;
  const HeadFilter& judge_;
  const ConnectionTimes& times_;
  BodyBudget& budget_;
  Time deadline_;
  Time started_{};  ///< of the body or the reply

  std::string input_;  ///< read and not yet understood; at most a head and one read's bytes
  std::optional<Request> arriving_;

  std::string output_;
  std::uint64_t written_ = 0;         ///< of output_
  std::optional<BodySource> source_;  ///< goes after output_
  std::uint64_t source_written_ = 0;
  bool keep_alive_ = false;
};

}  // namespace http
