#include "server/http/listener.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>

namespace http {
namespace {

constexpr int backlog = 1024;  // a burst while the loop is busy for some milliseconds; the kernel caps it at somaxconn

struct SocketAddress {
  sockaddr_storage storage{};
  socklen_t size = 0;
};

sockaddr* raw(SocketAddress& address) { return reinterpret_cast<sockaddr*>(&address.storage); }

SocketAddress socket_address(const std::string& host, std::uint16_t port) {
  SocketAddress address;
  sockaddr_in v4{};
  sockaddr_in6 v6{};
  if (inet_pton(AF_INET, host.c_str(), &v4.sin_addr) == 1) {
    v4.sin_family = AF_INET;
    v4.sin_port = htons(port);
    std::memcpy(&address.storage, &v4, sizeof v4);
    address.size = sizeof v4;
  } else if (inet_pton(AF_INET6, host.c_str(), &v6.sin6_addr) == 1) {
    v6.sin6_family = AF_INET6;
    v6.sin6_port = htons(port);
    std::memcpy(&address.storage, &v6, sizeof v6);
    address.size = sizeof v6;
  } else {
    throw std::system_error(EINVAL, std::generic_category(), "\"" + host + "\" is no literal address");
  }
  return address;
}

std::uint16_t port_of(const sockaddr_storage& storage) {
  sockaddr_in6 v6{};  // the port is at the same place in both
  std::memcpy(&v6, &storage, sizeof v6);
  return ntohs(v6.sin6_port);
}

std::string host_of(const sockaddr_storage& storage) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (storage.ss_family == AF_INET) {
    sockaddr_in v4{};
    std::memcpy(&v4, &storage, sizeof v4);
    inet_ntop(AF_INET, &v4.sin_addr, text.data(), text.size());
  } else {
    sockaddr_in6 v6{};
    std::memcpy(&v6, &storage, sizeof v6);
    inet_ntop(AF_INET6, &v6.sin6_addr, text.data(), text.size());
  }
  return text.data();
}

int open_spare() { return ::open("/dev/null", O_RDONLY | O_CLOEXEC); }

}  // namespace

Listener::Listener(const std::string& host, std::uint16_t port) {
  SocketAddress address = socket_address(host, port);
  const int on = 1;
  fd_ = ::socket(address.storage.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const bool listening = fd_ >= 0 && ::setsockopt(fd_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) == 0 &&
                         ::bind(fd_, raw(address), address.size) == 0 && ::listen(fd_, backlog) == 0 &&
                         ::getsockname(fd_, raw(address), &address.size) == 0;
  if (!listening) {
    const int error = errno;
    close();
    throw std::system_error(error, std::generic_category(),
                            "cannot listen on " + host + ", port " + std::to_string(port));
  }
  port_ = port_of(address.storage);
  spare_fd_ = open_spare();
}

Listener::~Listener() { close(); }

void Listener::close() {
  if (fd_ >= 0) ::close(fd_);
  if (spare_fd_ >= 0) ::close(spare_fd_);
  fd_ = spare_fd_ = -1;
}

std::optional<Listener::Accepted> Listener::accept(bool& exhausted) {
  SocketAddress peer;
  peer.size = sizeof peer.storage;
  const int fd = ::accept4(fd_, raw(peer), &peer.size, SOCK_NONBLOCK | SOCK_CLOEXEC);
  exhausted = fd < 0 && (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM);
  if (exhausted) reject_connection();
  if (fd < 0) return std::nullopt;
  const int on = 1;
  ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on,
               sizeof on);  // replies are written whole; a delay would only add 40 ms
  return Accepted{fd, host_of(peer.storage)};
}

void Listener::reject_connection() {
  if (spare_fd_ >= 0) ::close(spare_fd_);
  const int fd = ::accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC);
  if (fd >= 0) ::close(fd);
  spare_fd_ = open_spare();
}

}  // namespace http
