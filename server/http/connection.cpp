#include "server/http/connection.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <utility>

namespace http {
namespace {

/// Written to one client before the others have their turn.
constexpr std::uint64_t turn_bytes = 1u << 20;

}  // namespace

Connection::Connection(int fd, std::string remote, const HeadLimits& limits, const HeadFilter& judge,
                       const ConnectionTimes& times, BodyBudget& budget, Time now)
    : fd_(fd),
      remote_(std::move(remote)),
      limits_(limits),
      judge_(judge),
      times_(times),
      budget_(budget),
      deadline_(now + times.idle) {}

Connection::~Connection() { close(); }

void Connection::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
  state_ = State::closed;
}

bool Connection::wants_to_read() const {
  return state_ == State::reading_head || state_ == State::reading_body || state_ == State::lingering;
}

Time Connection::paced(Time start, std::chrono::milliseconds grace, std::uint64_t bytes) const {
  return start + grace + std::chrono::milliseconds(bytes * 1000 / times_.bytes_per_s);
}

void Connection::receive(Time now) {
  assert(wants_to_read());
  std::array<char, 64u << 10> buffer;  // NOLINT(cppcoreguidelines-pro-type-member-init): 64 KiB of zeros for nothing
  const ssize_t got = ::recv(fd_, buffer.data(), buffer.size(), 0);
  if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) return;
  if (got <= 0) return close();  // half a request is no request
  if (state_ == State::lingering) return;
  if (is_idle()) deadline_ = now + times_.head;
  input_.append(buffer.data(), static_cast<std::size_t>(got));
  read_input(now);
}

void Connection::proceed(Time now) {
  if (state_ == State::reading_head && !input_.empty()) read_input(now);
}

void Connection::read_input(Time now) {
  if (state_ == State::reading_head) {
    HeadResult result = read_head(input_, limits_);
    if (const auto* refused = std::get_if<RefusedHead>(&result)) return refuse({refused->failure, refused->detail, {}});
    if (std::holds_alternative<Incomplete>(result)) return;
    if (auto problem = judge_ ? judge_(std::get<RequestHead>(result)) : std::nullopt)
      return refuse(*std::move(problem));
    start_body(std::get<RequestHead>(std::move(result)), now);
  }
  fill_body();
}

void Connection::start_body(RequestHead head, Time now) {
  input_.erase(0, head.size_bytes);
  state_ = State::reading_body;
  started_ = now;
  deadline_ = now + times_.body_grace;
  if (head.expects_continue && input_.empty()) output_ = "HTTP/1.1 100 Continue\r\n\r\n";
  arriving_.emplace();
  arriving_->head = std::move(head);
  arriving_->remote = remote_;
  arriving_->body = Body(budget_);
}

void Connection::fill_body() {
  Body& body = arriving_->body;
  const std::uint64_t length = arriving_->head.content_length.value_or(0);
  const std::size_t count = std::min<std::uint64_t>(input_.size(), length - body.size_bytes());
  if (count > 0) {
    if (!body.append(std::string_view(input_).substr(0, count))) {
      return refuse({Failure::overloaded, "no room for another body of " + std::to_string(length) + " bytes now", {}});
    }
    input_.erase(0, count);
    deadline_ = paced(started_, times_.body_grace, body.size_bytes());
  }
  if (body.size_bytes() < length) return;
  request = std::exchange(arriving_, std::nullopt);
  state_ = State::handling;
  deadline_ = Time::max();
  input_.shrink_to_fit();
}

void Connection::refuse(Problem problem) {
  refusal = std::move(problem);
  arriving_.reset();
  state_ = State::handling;
  deadline_ = Time::max();
  input_ = {};  // what follows cannot be framed
}

/// After what the socket has not taken yet: a 100 Continue.
void Connection::put(std::string text) {
  output_.erase(0, written_);
  written_ = 0;
  if (output_.empty()) {
    output_ = std::move(text);
  } else {
    output_ += text;
  }
}

void Connection::start_stream(std::string text, Time now) {
  assert(state_ == State::handling);
  state_ = State::streaming;
  input_ = {};  // no reply would come to what follows
  append(std::move(text), now);
}

void Connection::append(std::string text, Time now) {
  put(std::move(text));
  deadline_ = paced(now, times_.write_grace, 0);
  send(now);
}

void Connection::end_stream(Time now) {
  keep_alive_ = false;
  state_ = State::writing;
  started_ = now;
  if (!wants_to_write()) finish_reply(now);
}

void Connection::reply(std::string text, std::optional<BodySource> source, bool keep_alive, Time now) {
  assert(state_ == State::handling);
  state_ = State::writing;
  put(std::move(text));
  source_ = std::move(source);
  source_written_ = 0;
  keep_alive_ = keep_alive;
  started_ = now;
  deadline_ = paced(now, times_.write_grace, 0);
  send(now);
}

void Connection::send(Time now) {
  for (std::uint64_t turn = 0; wants_to_write() && turn < turn_bytes;) {
    const ssize_t wrote =
        written_ < output_.size() ? send_bytes(std::string_view(output_).substr(written_)) : send_piece_of_source();
    if (wrote < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) return;
    if (wrote <= 0) return close();
    const auto count = static_cast<std::uint64_t>(wrote);
    (written_ < output_.size() ? written_ : source_written_) += count;
    turn += count;
    if (state_ == State::writing) deadline_ = paced(started_, times_.write_grace, written_ + source_written_);
  }
  if (!wants_to_write() && state_ == State::writing) finish_reply(now);
  if (!wants_to_write() && state_ == State::streaming) {
    std::string().swap(output_);  // many streams wait, most of the time: none keeps a buffer
    written_ = 0;
    deadline_ = Time::max();
  }
}

ssize_t Connection::send_bytes(std::string_view bytes) const {
  return ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
}

/// What the socket does not take is read again next time, so a slow reader holds no memory. 0: the source failed, and
/// the reply must end short.
ssize_t Connection::send_piece_of_source() {
  std::array<char, 256u << 10> piece;  // NOLINT(cppcoreguidelines-pro-type-member-init): overwritten by the read
  const std::size_t wanted = std::min<std::uint64_t>(piece.size(), source_left());
  try {
    const std::size_t got = source_->read(source_written_, piece.data(), wanted);
    return got == 0 ? 0 : send_bytes(std::string_view(piece.data(), got));
  } catch (...) {
    return 0;
  }
}

void Connection::finish_reply(Time now) {
  source_.reset();
  output_ = {};
  written_ = 0;
  if (keep_alive_) {
    state_ = State::reading_head;
    deadline_ = now + (input_.empty() ? times_.idle : times_.head);
    return;
  }
  ::shutdown(fd_, SHUT_WR);
  state_ = State::lingering;
  deadline_ = now + times_.linger;
}

void Connection::expire() {
  const bool silent = is_idle() || state_ == State::writing || state_ == State::streaming || state_ == State::lingering;
  if (silent) return close();
  if (state_ == State::reading_head || state_ == State::reading_body) {
    refuse({Failure::request_timeout,
            state_ == State::reading_head
                ? "the head did not come in time"
                : "the body came slower than " + std::to_string(times_.bytes_per_s) + " bytes/s",
            {}});
  }
}

}  // namespace http
