#include "server/http/connection.h"

#include <sys/epoll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <utility>

namespace http {
namespace {

/// Bytes that are written to one client before other clients are served.
constexpr std::uint64_t send_burst_bytes = 1u << 20;

bool must_wait() { return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR; }

}  // namespace

Connection::Connection(support::Descriptor socket, std::string remote, const HttpServerSettings& settings,
                       BodyBudget& budget, Time now)
    : socket_(std::move(socket)),
      remote_(std::move(remote)),
      settings_(settings),
      budget_(budget),
      deadline_(now + settings.times.idle) {}

void Connection::close() {
  socket_.reset();
  state_ = State::closed;
}

bool Connection::needs_input() const {
  return state_ == State::reading_head || state_ == State::reading_body || state_ == State::lingering;
}

Time Connection::transfer_deadline(std::chrono::milliseconds grace, std::uint64_t bytes) const {
  return started_ + grace + std::chrono::milliseconds(bytes * 1000 / settings_.times.bytes_per_s);
}

void Connection::receive(Time now) {
  assert(needs_input());
  std::array<char, 64u << 10> buffer;  // NOLINT(cppcoreguidelines-pro-type-member-init): 64 KiB of zeros for nothing
  const ssize_t received = ::recv(fd(), buffer.data(), buffer.size(), 0);
  if (received < 0 && must_wait()) return;
  if (received <= 0) return close();  // an incomplete request is dropped
  if (state_ == State::lingering) return;
  if (is_idle()) deadline_ = now + settings_.times.head;
  input_.append(buffer.data(), static_cast<std::size_t>(received));
  read_input(now);
}

void Connection::proceed(Time now) {
  if (state_ == State::reading_head && !input_.empty()) read_input(now);
}

void Connection::read_input(Time now) {
  if (state_ == State::reading_head) {
    HeadResult result = read_head(input_, settings_.head);
    if (auto* problem = std::get_if<Problem>(&result)) return refuse(std::move(*problem));
    if (std::holds_alternative<Incomplete>(result)) return;
    auto& head = std::get<RequestHead>(result);
    auto key = settings_.access ? settings_.access(head) : std::optional<keys::Key>();
    if (!key) return refuse(std::move(key.error()));
    start_body(std::move(head), *std::move(key), now);
  }
  fill_body();
}

void Connection::start_body(RequestHead head, std::optional<keys::Key> key, Time now) {
  input_.erase(0, head.size_bytes);
  state_ = State::reading_body;
  started_ = now;
  deadline_ = now + settings_.times.body_grace;
  if (head.expects_continue && input_.empty()) output_ = "HTTP/1.1 100 Continue\r\n\r\n";
  incoming_.emplace();
  incoming_->remote = remote_;
  if (head.content_length.value_or(0) > 0) incoming_->body = Body(budget_);
  incoming_->head = std::move(head);
  incoming_->key = std::move(key);
}

void Connection::check_access() {
  if (!settings_.access || !incoming_) return;
  if (auto key = settings_.access(incoming_->head); !key) refuse(std::move(key.error()));
}

void Connection::fill_body() {
  Body& body = incoming_->body;
  const std::uint64_t length = incoming_->head.content_length.value_or(0);
  const std::size_t count = std::min<std::uint64_t>(input_.size(), length - body.size_bytes());
  if (count > 0) {
    if (!body.append(std::string_view(input_).substr(0, count))) {
      return refuse({failures::overloaded, "no space for another body of " + std::to_string(length) + " bytes now"});
    }
    input_.erase(0, count);
    deadline_ = transfer_deadline(settings_.times.body_grace, body.size_bytes());
  }
  if (body.size_bytes() < length) return;
  request = std::exchange(incoming_, std::nullopt);
  state_ = State::handling;
  deadline_ = Time::max();
  input_.shrink_to_fit();
}

void Connection::refuse(Problem problem) {
  refusal = std::move(problem);
  incoming_.reset();
  state_ = State::handling;
  deadline_ = Time::max();
  input_ = {};  // the boundaries of later requests are unknown
}

void Connection::start_stream(std::string text, Time now) {
  assert(state_ == State::handling);
  state_ = State::streaming;
  input_ = {};  // pipelined requests get no reply
  append(std::move(text), now);
}

void Connection::append(std::string text, Time now) {
  output_.erase(0, written_);
  written_ = 0;
  output_ = output_.empty() ? std::move(text) : output_ + text;  // a 100 Continue may not be sent yet
  started_ = now;
  deadline_ = transfer_deadline(settings_.times.write_grace, 0);
  send(now);
}

void Connection::end_stream(Time now) {
  keep_alive_ = false;
  state_ = State::writing;
  started_ = now;
  if (!has_output()) finish_reply(now);
}

void Connection::reply(std::string text, std::optional<BodySource> source, bool keep_alive, Time now) {
  assert(state_ == State::handling);
  state_ = State::writing;
  source_ = std::move(source);
  source_written_ = 0;
  keep_alive_ = keep_alive;
  append(std::move(text), now);
}

void Connection::send(Time now) {
  for (std::uint64_t sent = 0; has_output() && sent < send_burst_bytes;) {
    const bool from_output = written_ < output_.size();
    const ssize_t wrote = from_output ? send_bytes(std::string_view(output_).substr(written_)) : send_source();
    if (wrote < 0 && must_wait()) return;
    if (wrote <= 0) return close();
    const auto count = static_cast<std::uint64_t>(wrote);
    (from_output ? written_ : source_written_) += count;
    if (!from_output && settings_.body_threads > 0) part_written_ += count;
    sent += count;
    if (state_ == State::writing && !part_requested_) {
      deadline_ = transfer_deadline(settings_.times.write_grace, written_ + source_written_);
    }
  }
  if (has_output() || source_left() > 0) return;
  if (state_ == State::writing) finish_reply(now);
  if (state_ == State::streaming) {
    std::string().swap(output_);  // most streams are silent most of the time, so none keeps a buffer
    written_ = 0;
    deadline_ = Time::max();
  }
}

ssize_t Connection::send_bytes(std::string_view bytes) const {
  return ::send(fd(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
}

/// Bytes that the socket does not accept are read again the next time, so a slow client holds no memory. Returns 0 if
/// the source failed; the reply must then be cut short.
ssize_t Connection::send_source() {
  if (settings_.body_threads > 0) return send_bytes(std::string_view(part_).substr(part_written_));
  std::array<char, 256u << 10> piece;  // NOLINT(cppcoreguidelines-pro-type-member-init): overwritten by the read
  const std::size_t wanted = std::min<std::uint64_t>(piece.size(), source_left());
  try {
    const std::size_t count = source_->read(source_written_, piece.data(), wanted);
    return count == 0 ? 0 : send_bytes(std::string_view(piece.data(), count));
  } catch (...) {
    return 0;
  }
}

std::optional<Connection::BodyPart> Connection::take_body_part(Time now) {
  constexpr std::size_t part_bytes_max = 1u << 20;
  const bool is_wanted = settings_.body_threads > 0 && state_ == State::writing && source_left() > 0;
  if (!is_wanted || part_requested_ || part_written_ < part_.size()) return std::nullopt;
  part_requested_ = now;
  deadline_ = Time::max();
  return BodyPart{*source_, source_written_, std::min<std::uint64_t>(part_bytes_max, source_left())};
}

void Connection::add_body_part(std::string bytes, Time now) {
  if (state_ != State::writing || !part_requested_) return;
  started_ += now - *part_requested_;  // the client was not slow
  part_requested_.reset();
  if (bytes.empty()) return close();
  part_ = std::move(bytes);
  part_written_ = 0;
  deadline_ = transfer_deadline(settings_.times.write_grace, written_ + source_written_);
  send(now);
}

void Connection::finish_reply(Time now) {
  source_.reset();
  part_ = {};
  part_written_ = 0;
  output_ = {};
  written_ = 0;
  if (keep_alive_) {
    state_ = State::reading_head;
    deadline_ = now + (input_.empty() ? settings_.times.idle : settings_.times.head);
    return;
  }
  ::shutdown(fd(), SHUT_WR);
  state_ = State::lingering;
  deadline_ = now + settings_.times.linger;
}

void Connection::expire() {
  if (is_idle() || state_ == State::writing || state_ == State::streaming || state_ == State::lingering) {
    return close();
  }
  if (state_ == State::reading_head) {
    refuse({failures::request_timeout, "the head was not complete in time"});
  } else if (state_ == State::reading_body) {
    const std::string rate = std::to_string(settings_.times.bytes_per_s);
    refuse({failures::request_timeout, "the body was slower than " + rate + " bytes/s"});
  }
}

Time Client::deadline() const {
  if (stream) return std::min(connection.deadline(), heartbeat_due);
  return is_deferred() ? std::min(connection.deadline(), pending->deferred.deadline) : connection.deadline();
}

std::uint32_t Client::events() const {
  std::uint32_t events = 0;
  if (is_waiting()) events |= EPOLLRDHUP;
  if (connection.needs_input()) events |= EPOLLIN;
  if (connection.has_output()) events |= EPOLLOUT;
  return events;
}

void Client::start_stream(std::string text, std::shared_ptr<BodyStream> body, Time now) {
  connection.start_stream(std::move(text), now);
  stream = std::move(body);
  heartbeat_due = now + stream->heartbeat_interval;
  pending->request.body = {};  // a stream may last for days; check_access needs the head
}

void Client::feed_stream(Time now) {
  while (stream && connection.state() == Connection::State::streaming && !connection.has_output()) {
    BodyStream::Chunk chunk = stream->take();
    if (chunk.text.empty() && !chunk.last) return;
    heartbeat_due = now + stream->heartbeat_interval;
    if (!chunk.text.empty()) connection.append(std::move(chunk.text), now);
    if (chunk.last) end_stream(now);
  }
}

void Client::send_heartbeat(Time now) {
  heartbeat_due = now + stream->heartbeat_interval;
  if (!connection.has_output()) connection.append(stream->heartbeat, now);
}

void Client::end_stream(Time now) {
  stream.reset();
  if (connection.state() == Connection::State::streaming) connection.end_stream(now);
}

}  // namespace http
