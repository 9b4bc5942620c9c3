#pragma once
/// A listening TCP socket.

#include <cstdint>
#include <optional>
#include <string>

#include "server/support/descriptor.h"

namespace http {

class Listener {
 public:
  /// Binds and listens. `host` is a literal address; port 0 selects a free one. Throws std::system_error with a message
  /// that names the address. `descriptors_kept`: so many stay free for others, as far as clients take them.
  Listener(const std::string& host, std::uint16_t port, int descriptors_kept = 0);

  [[nodiscard]] int fd() const { return socket_.get(); }
  [[nodiscard]] std::uint16_t port() const { return port_; }

  struct Accepted {
    support::Descriptor socket;  ///< non-blocking, closed on exec, with TCP_NODELAY
    std::string remote;
  };
  /// Accepts the next waiting client, if any. If descriptors are exhausted, sets `exhausted` and closes one waiting
  /// client; otherwise the loop would spin on it.
  std::optional<Accepted> accept(bool& exhausted);

  void close();  ///< the kernel refuses later clients

 private:
  void close_one_client();
  [[nodiscard]] bool leaves_reserve(int descriptor) const;

  support::Descriptor socket_;
  support::Descriptor reserve_;  ///< closed for a moment to accept and close a client if there is no other descriptor
  std::uint16_t port_ = 0;
  int descriptors_kept_ = 0;
};

}  // namespace http
