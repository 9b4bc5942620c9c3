#pragma once
/// Sends a POST to an untrusted server: limited in time and bytes, only to allowed addresses, without redirections.
/// Allowed addresses are public ones, and networks that the operator allows. Otherwise a client could make the daemon
/// send requests to internal services (server-side request forgery).

#include <sys/socket.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tracer/result.h"

namespace webhooks {

/// An IPv6 address, or an IPv4 one as ::ffff:a.b.c.d.
using Address = std::array<std::uint8_t, 16>;

/// The address of an IPv4 or IPv6 socket; none of another family.
std::optional<Address> address_of(const sockaddr* socket_address, std::size_t size);
std::string text_of(const Address& address);

/// True for globally reachable unicast (IANA special-purpose address registries, RFC 6890): not private, shared,
/// loopback, link-local, documentation, benchmarking, multicast, reserved, nor IPv6 that translates to IPv4.
bool is_public(const Address& address);

/// The addresses that share the first `bits`.
struct Network {
  Address address{};
  int bits = 128;
};

class Networks {
 public:
  /// Parses "127.0.0.0/8, fd00::/8, 10.1.2.3"; may be empty. An error is a sentence.
  static tracer::Result<Networks, std::string> parse(const std::string& text);

  /// True if the address is public or in one of the networks.
  [[nodiscard]] bool allow(const Address& address) const;

 private:
  std::vector<Network> networks_;
};

struct SenderSettings {
  Networks networks;  ///< allowed although they are not public
  std::chrono::milliseconds connect_timeout{5'000};
  std::chrono::milliseconds timeout{10'000};   ///< limit of the whole request
  std::size_t response_bytes_max = 64u << 10;  ///< headers included; the content is dropped
};

struct Response {
  int status = 0;      ///< HTTP status; 0 without a response
  std::string detail;  ///< the reason if there is none
};

class WebhookSender {
 public:
  explicit WebhookSender(SenderSettings settings);
  ~WebhookSender();
  WebhookSender(WebhookSender&&) = delete;

  using Headers = std::vector<std::pair<std::string, std::string>>;
  /// `url` is http or https. Connects to the address that was checked, even if the name resolves to another one later.
  /// Redirections are ordinary responses; proxies, cookies and credentials of the environment are not used. Ends early
  /// when `stop` is set. Throws only std::bad_alloc.
  [[nodiscard]] Response post(const std::string& url, const Headers& headers, const std::string& body,
                              const std::atomic<bool>& stop) const;

 private:
  SenderSettings settings_;
};

}  // namespace webhooks
