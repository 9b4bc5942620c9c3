#include "server/http/listener.h"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <memory>
#include <system_error>

namespace http {
namespace {

constexpr int backlog = 1024;  // a burst while the loop is busy for some milliseconds; the kernel caps it at somaxconn

using AddressList = std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)>;

AddressList parse_address(const std::string& host, std::uint16_t port) {
  addrinfo hints{};
  hints.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found) != 0) {
    throw std::system_error(EINVAL, std::generic_category(), "\"" + host + "\" is no literal address");
  }
  return {found, &::freeaddrinfo};
}

struct SocketAddress {
  sockaddr_storage storage{};
  socklen_t size = sizeof storage;

  sockaddr* get() { return reinterpret_cast<sockaddr*>(&storage); }
  std::string host() {
    std::array<char, NI_MAXHOST> text{};
    ::getnameinfo(get(), size, text.data(), text.size(), nullptr, 0, NI_NUMERICHOST);
    return text.data();
  }
  std::uint16_t port() {
    std::array<char, NI_MAXSERV> text{};
    ::getnameinfo(get(), size, nullptr, 0, text.data(), text.size(), NI_NUMERICSERV);
    return static_cast<std::uint16_t>(std::stoi(text.data()));
  }
};

support::Descriptor open_reserve() { return support::Descriptor(::open("/dev/null", O_RDONLY | O_CLOEXEC)); }

}  // namespace

Listener::Listener(const std::string& host, std::uint16_t port, int descriptors_kept)
    : descriptors_kept_(descriptors_kept) {
  const AddressList address = parse_address(host, port);
  const int on = 1;
  SocketAddress bound;
  socket_ = support::Descriptor(::socket(address->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const bool listening = socket_ && ::setsockopt(fd(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) == 0 &&
                         ::bind(fd(), address->ai_addr, address->ai_addrlen) == 0 && ::listen(fd(), backlog) == 0 &&
                         ::getsockname(fd(), bound.get(), &bound.size) == 0;
  if (!listening) {
    const int error = errno;
    throw std::system_error(error, std::generic_category(),
                            "cannot listen on " + host + ", port " + std::to_string(port));
  }
  port_ = bound.port();
  reserve_ = open_reserve();
}

void Listener::close() {
  socket_.reset();
  reserve_.reset();
}

std::optional<Listener::Accepted> Listener::accept(bool& exhausted) {
  SocketAddress peer;
  support::Descriptor socket(::accept4(fd(), peer.get(), &peer.size, SOCK_NONBLOCK | SOCK_CLOEXEC));
  exhausted = !socket && (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM);
  if (exhausted) close_one_client();
  if (!socket) return std::nullopt;
  exhausted = !leaves_reserve(socket.get());
  if (exhausted) return std::nullopt;
  const int on = 1;  // replies are written whole; Nagle's algorithm would only add 40 ms
  ::setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  return Accepted{std::move(socket), peer.host()};
}

/// A new descriptor is the lowest free one, so that all below it are in use.
bool Listener::leaves_reserve(int descriptor) const {
  rlimit limit{};
  if (descriptors_kept_ == 0 || ::getrlimit(RLIMIT_NOFILE, &limit) != 0) return true;
  return static_cast<rlim_t>(descriptor) + static_cast<rlim_t>(descriptors_kept_) < limit.rlim_cur;
}

void Listener::close_one_client() {
  reserve_.reset();
  support::Descriptor client(::accept4(fd(), nullptr, nullptr, SOCK_CLOEXEC));
  client.reset();
  reserve_ = open_reserve();
}

}  // namespace http
