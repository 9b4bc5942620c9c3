#include "server/webhooks/networks.h"

#include <arpa/inet.h>
#include <netinet/in.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <optional>
#include <sstream>

namespace webhooks {
namespace {

constexpr int v4_prefix_bits = 96;
constexpr Address v4_mapped{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 0, 0, 0, 0};

/// In CIDR notation, from the registries.
constexpr const char* special[] = {
    "0.0.0.0/8",     "10.0.0.0/8",      "100.64.0.0/10",  "127.0.0.0/8",    "169.254.0.0/16",
    "172.16.0.0/12", "192.0.0.0/24",    "192.0.2.0/24",   "192.88.99.0/24", "192.168.0.0/16",
    "198.18.0.0/15", "198.51.100.0/24", "203.0.113.0/24", "224.0.0.0/4",    "240.0.0.0/4",
    "2001::/23",     "2001:db8::/32",   "2002::/16",      "3fff::/20",
};
constexpr const char* global_unicast = "2000::/3";  // the allocated part of IPv6

bool contains(const Network& network, const Address& address) {
  for (int bit = 0; bit < network.bits; bit += 8) {
    const auto byte = static_cast<std::size_t>(bit / 8);
    const int used = std::min(network.bits - bit, 8);
    const int mask = 0xff << (8 - used) & 0xff;
    if (((network.address[byte] ^ address[byte]) & mask) != 0) return false;
  }
  return true;
}

/// The address of `text`, IPv4 mapped into IPv6, and its number of bits.
std::optional<Network> read_address(const std::string& text) {
  Network network{v4_mapped, 32};
  if (inet_pton(AF_INET, text.c_str(), &network.address[12]) == 1) return network;
  network.bits = 128;
  if (inet_pton(AF_INET6, text.c_str(), network.address.data()) == 1) return network;
  return std::nullopt;
}

std::optional<Network> read_network(std::string_view text) {
  const std::size_t slash = text.find('/');
  auto network = read_address(std::string(text.substr(0, slash)));
  if (!network) return std::nullopt;
  const int bits_max = network->bits;
  if (slash != std::string_view::npos) {
    const std::string_view number = text.substr(slash + 1);
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), network->bits);
    if (error != std::errc() || end != number.data() + number.size()) return std::nullopt;
  }
  if (network->bits < 0 || network->bits > bits_max) return std::nullopt;
  if (bits_max == 32) network->bits += v4_prefix_bits;
  return network;
}

bool is_in(const char* network, const Address& address) { return contains(*read_network(network), address); }

}  // namespace

std::optional<Address> address_of(const sockaddr* socket_address, std::size_t size) {
  if (socket_address->sa_family == AF_INET && size >= sizeof(sockaddr_in)) {
    sockaddr_in v4{};
    std::memcpy(&v4, socket_address, sizeof v4);
    Address address = v4_mapped;
    std::memcpy(&address[12], &v4.sin_addr, 4);
    return address;
  }
  if (socket_address->sa_family == AF_INET6 && size >= sizeof(sockaddr_in6)) {
    sockaddr_in6 v6{};
    std::memcpy(&v6, socket_address, sizeof v6);
    Address address{};
    std::memcpy(address.data(), &v6.sin6_addr, address.size());
    return address;
  }
  return std::nullopt;
}

std::string text_of(const Address& address) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  const bool is_v4 = contains({v4_mapped, v4_prefix_bits}, address);
  inet_ntop(is_v4 ? AF_INET : AF_INET6, is_v4 ? &address[12] : address.data(), text.data(), text.size());
  return text.data();
}

bool is_public(const Address& address) {
  const bool is_v4 = contains({v4_mapped, v4_prefix_bits}, address);
  if (!is_v4 && !is_in(global_unicast, address)) return false;
  return std::none_of(std::begin(special), std::end(special),
                      [&](const char* network) { return is_in(network, address); });
}

tracer::Result<Networks, std::string> Networks::parse(const std::string& text) {
  Networks networks;
  if (text.find_first_not_of(' ') == std::string::npos) return networks;
  std::istringstream parts(text);
  std::string part;
  while (std::getline(parts, part, ',')) {
    const std::size_t first = std::min(part.find_first_not_of(' '), part.size());
    part = part.substr(first, part.find_last_not_of(' ') + 1 - first);
    const auto network = read_network(part);
    if (!network) return "must be networks such as 10.0.0.0/8 or fd00::/8 separated by commas, got \"" + part + "\"";
    networks.networks_.push_back(*network);
  }
  return networks;
}

bool Networks::allow(const Address& address) const {
  return is_public(address) || std::any_of(networks_.begin(), networks_.end(),
                                           [&](const Network& network) { return contains(network, address); });
}

}  // namespace webhooks
