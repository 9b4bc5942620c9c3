#pragma once
/// A listening TCP socket.

#include <cstdint>
#include <optional>
#include <string>

namespace http {

class Listener {
 public:
  /// Binds and listens. `host` is a literal address; port 0 takes a free one. Throws std::system_error with a sentence
  /// that names the address.
  Listener(const std::string& host, std::uint16_t port);
  Listener(const Listener&) = delete;
  ~Listener();

  [[nodiscard]] int fd() const { return fd_; }
  [[nodiscard]] std::uint16_t port() const { return port_; }

  struct Accepted {
    int fd = -1;  ///< non-blocking, closed on exec, without Nagle's delay; the caller's
    std::string remote;
  };
  /// The next waiting client, if any. When descriptors are exhausted one waiting client is turned away, so that the
  /// loop does not spin on it; `exhausted` tells.
  std::optional<Accepted> accept(bool& exhausted);

  void close();  ///< later clients are refused by the kernel

 private:
  void reject_connection();

  int fd_ = -1;
  int spare_fd_ = -1;  ///< given up for a moment to accept and close a client when there are no others
  std::uint16_t port_ = 0;
};

}  // namespace http
