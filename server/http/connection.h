#pragma once
/// The socket of one client: reads one checked request at a time within limits and deadlines, then writes its reply.
/// Used by the event loop's thread only; it has no access to epoll and handlers.
///
///   reading_head -> reading_body -> handling -> writing -> reading_head ... | lingering -> closed
///                                            -> streaming -> lingering -> closed
///
/// Nothing is read while a request is handled, so pipelined requests wait in the socket and are answered in order.

#include <sys/types.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "server/http/body.h"
#include "server/http/http_messages.h"
#include "server/http/http_server.h"
#include "server/http/timer_queue.h"
#include "server/support/descriptor.h"

namespace http {

class Connection {
 public:
  enum class State { reading_head, reading_body, handling, writing, streaming, lingering, closed };

  /// `socket` is connected and non-blocking. The references must outlive the connection.
  Connection(support::Descriptor socket, std::string remote, const HttpServerSettings& settings, BodyBudget& budget,
             Time now);

  [[nodiscard]] int fd() const { return socket_.get(); }
  [[nodiscard]] State state() const { return state_; }
  [[nodiscard]] const std::string& remote() const { return remote_; }
  [[nodiscard]] Time deadline() const { return deadline_; }  ///< Time::max(): none
  [[nodiscard]] bool wants_to_read() const;
  [[nodiscard]] bool wants_to_write() const { return written_ < output_.size() || source_left() > 0; }
  /// Between requests, with no byte of the next one read.
  [[nodiscard]] bool is_idle() const { return state_ == State::reading_head && input_.empty(); }

  /// Reads the available bytes. Afterwards a request may be complete (state handling, `request` is set), refused
  /// (`refusal` is set), or the connection closed.
  void receive(Time now);
  /// Parses a pipelined request whose bytes were received before. Call after a reply.
  void proceed(Time now);

  std::optional<Request> request;  ///< complete, for the event loop to take; its id is empty
  std::optional<Problem> refusal;  ///< for the event loop to take and to answer

  /// Starts the reply: `text` is head and body, `source` follows.
  void reply(std::string text, std::optional<BodySource> source, bool keep_alive, Time now);
  /// Starts a reply whose body comes by `append` until `end_stream`. Appended text must be sent within the write grace.
  void start_stream(std::string text, Time now);
  void append(std::string text, Time now);
  void end_stream(Time now);
  /// Writes as much as the socket accepts. After the last byte the next request is read or the connection ends.
  void send(Time now);

  /// Stops reading the request and sets `refusal`.
  void refuse(Problem problem);

  /// Call when `deadline()` has passed.
  void expire();
  void close();

 private:
  void read_input(Time now);
  void start_body(RequestHead head, Time now);
  void fill_body();
  void finish_reply(Time now);
  [[nodiscard]] ssize_t send_bytes(std::string_view bytes) const;
  ssize_t send_source();
  [[nodiscard]] std::uint64_t source_left() const { return source_ ? source_->size_bytes - source_written_ : 0; }
  /// The deadline of a transfer of `bytes` that began at started_.
  [[nodiscard]] Time transfer_deadline(std::chrono::milliseconds grace, std::uint64_t bytes) const;

  support::Descriptor socket_;
  State state_ = State::reading_head;
  std::string remote_;
  const HttpServerSettings& settings_;
  BodyBudget& budget_;
  Time deadline_;
  Time started_{};  ///< beginning of the body or of the reply

  std::string input_;  ///< received and not parsed; at most a head and the bytes of one read
  std::optional<Request> incoming_;

  std::string output_;
  std::uint64_t written_ = 0;         ///< bytes of output_ that were sent
  std::optional<BodySource> source_;  ///< follows output_
  std::uint64_t source_written_ = 0;
  bool keep_alive_ = false;
};

}  // namespace http
