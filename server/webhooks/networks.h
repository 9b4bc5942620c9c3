#pragma once
/// Which addresses a webhook may reach: those of the open internet, and networks that the operator allows by name.
/// Otherwise whoever may submit jobs could make the daemon speak to what only it can reach.

#include <sys/socket.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tracer/result.h"

namespace webhooks {

/// An IPv6 address, or an IPv4 one as ::ffff:a.b.c.d.
using Address = std::array<std::uint8_t, 16>;

/// The address of a socket; none of another family than IPv4 and IPv6.
std::optional<Address> address_of(const sockaddr* socket_address, std::size_t size);
std::string text_of(const Address& address);

/// Whether the registries call it globally reachable unicast (IANA special-purpose address registries, RFC 6890):
/// not private, shared, loopback, link-local, documentation, benchmarking, multicast, reserved, nor an IPv6 address
/// that stands for an IPv4 one by translation.
bool is_public(const Address& address);

/// Addresses that begin with the same `bits`.
struct Network {
  Address address{};
  int bits = 128;
};

class Networks {
 public:
  /// "127.0.0.0/8, fd00::/8, 10.1.2.3": empty is none; otherwise a sentence says what is wrong.
  static tracer::Result<Networks, std::string> parse(std::string_view text);

  /// Public, or in one of these.
  [[nodiscard]] bool allow(const Address& address) const;

 private:
  std::vector<Network> networks_;
};

}  // namespace webhooks
