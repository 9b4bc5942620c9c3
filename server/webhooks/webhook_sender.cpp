#include "server/webhooks/webhook_sender.h"

#include <arpa/inet.h>
#include <curl/curl.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <new>
#include <optional>
#include <sstream>

#include "server/support/text_values.h"

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
  if (slash != std::string_view::npos) network->bits = support::parse_number<int>(text.substr(slash + 1)).value_or(-1);
  if (network->bits < 0 || network->bits > bits_max) return std::nullopt;
  if (bits_max == 32) network->bits += v4_prefix_bits;
  return network;
}

bool is_in(const char* network, const Address& address) { return contains(*read_network(network), address); }

/// The context of the callbacks of one request.
struct Request {
  const SenderSettings& settings;
  const std::atomic<bool>& stop;
  std::size_t received = 0;
  std::string rejected_address;
};

/// All connections are made here, so the checked address is the connected one.
curl_socket_t open_socket(void* context, curlsocktype, curl_sockaddr* target) {
  auto& request = *static_cast<Request*>(context);
  const auto address = address_of(&target->addr, target->addrlen);
  if (!address || !request.settings.networks.allow(*address)) {
    request.rejected_address = address ? text_of(*address) : "of an unknown family";
    return CURL_SOCKET_BAD;
  }
  return ::socket(target->family, target->socktype | SOCK_CLOEXEC, target->protocol);
}

/// Counts and drops headers and body. Accepting fewer bytes than given ends the request.
std::size_t drop_received(const char*, std::size_t size, std::size_t count, void* context) {
  auto& request = *static_cast<Request*>(context);
  request.received += size * count;
  return request.received <= request.settings.response_bytes_max ? size * count : 0;
}

int check_stop(void* context, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
  return static_cast<Request*>(context)->stop ? 1 : 0;
}

using Easy = std::unique_ptr<CURL, decltype(&curl_easy_cleanup)>;
using List = std::unique_ptr<curl_slist, decltype(&curl_slist_free_all)>;

List list_of(const WebhookSender::Headers& headers) {
  List list(nullptr, &curl_slist_free_all);
  for (const auto& [name, value] : headers) {
    const std::string line = std::string(name).append(": ").append(value);
    curl_slist* longer = curl_slist_append(list.get(), line.c_str());
    if (longer == nullptr) throw std::bad_alloc();
    (void)list.release();
    list.reset(longer);
  }
  return list;
}

void set_options(CURL* easy, Request& request) {
  const auto set = [&](CURLoption option, auto value) {
    if (curl_easy_setopt(easy, option, value) != CURLE_OK) throw std::bad_alloc();
  };
  set(CURLOPT_PROTOCOLS_STR, "http,https");
  set(CURLOPT_FOLLOWLOCATION, 0L);
  set(CURLOPT_PROXY, "");  // ignores the environment
  set(CURLOPT_NOSIGNAL, 1L);
  set(CURLOPT_FRESH_CONNECT, 1L);
  set(CURLOPT_FORBID_REUSE, 1L);
  set(CURLOPT_HTTP_VERSION, static_cast<long>(CURL_HTTP_VERSION_1_1));
  set(CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(request.settings.connect_timeout.count()));
  set(CURLOPT_TIMEOUT_MS, static_cast<long>(request.settings.timeout.count()));
  set(CURLOPT_OPENSOCKETFUNCTION, &open_socket);
  set(CURLOPT_OPENSOCKETDATA, static_cast<void*>(&request));
  set(CURLOPT_WRITEFUNCTION, &drop_received);
  set(CURLOPT_WRITEDATA, static_cast<void*>(&request));
  set(CURLOPT_HEADERFUNCTION, &drop_received);
  set(CURLOPT_HEADERDATA, static_cast<void*>(&request));
  set(CURLOPT_XFERINFOFUNCTION, &check_stop);
  set(CURLOPT_XFERINFODATA, static_cast<void*>(&request));
  set(CURLOPT_NOPROGRESS, 0L);
}

std::string failure_reason(CURLcode code, const Request& request, const std::array<char, CURL_ERROR_SIZE>& error) {
  if (!request.rejected_address.empty()) {
    return "the address " + request.rejected_address + " is not public, and no network of the option webhook_networks";
  }
  if (request.received > request.settings.response_bytes_max) {
    return "the response has more than " + std::to_string(request.settings.response_bytes_max) + " bytes";
  }
  return error.front() != '\0' ? error.data() : curl_easy_strerror(code);
}

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
  return std::ranges::none_of(special, [&](const char* network) { return is_in(network, address); });
}

tracer::Result<Networks, std::string> Networks::parse(const std::string& text) {
  Networks networks;
  if (text.find_first_not_of(' ') == std::string::npos) return networks;
  std::istringstream parts(text);
  std::string part;
  while (std::getline(parts, part, ',')) {
    part = std::string(support::trimmed(part));
    const auto network = read_network(part);
    if (!network) return "must be networks such as 10.0.0.0/8 or fd00::/8 separated by commas, got \"" + part + "\"";
    networks.networks_.push_back(*network);
  }
  return networks;
}

bool Networks::allow(const Address& address) const {
  return is_public(address) ||
         std::ranges::any_of(networks_, [&](const Network& network) { return contains(network, address); });
}

WebhookSender::WebhookSender(SenderSettings settings) : settings_(std::move(settings)) {
  if (curl_global_init(CURL_GLOBAL_DEFAULT) != CURLE_OK) throw std::bad_alloc();
}
WebhookSender::~WebhookSender() { curl_global_cleanup(); }

Response WebhookSender::post(const std::string& url, const Headers& headers, const std::string& body,
                             const std::atomic<bool>& stop) const {
  const Easy easy(curl_easy_init(), &curl_easy_cleanup);
  if (easy == nullptr) throw std::bad_alloc();
  Request request{settings_, stop, 0, {}};
  set_options(easy.get(), request);
  Headers all = headers;
  all.emplace_back("Expect", "");  // does not wait for 100 Continue
  const List list = list_of(all);
  std::array<char, CURL_ERROR_SIZE> error{};
  curl_easy_setopt(easy.get(), CURLOPT_ERRORBUFFER, error.data());
  curl_easy_setopt(easy.get(), CURLOPT_HTTPHEADER, list.get());
  curl_easy_setopt(easy.get(), CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(body.size()));
  curl_easy_setopt(easy.get(), CURLOPT_POSTFIELDS, body.data());
  if (curl_easy_setopt(easy.get(), CURLOPT_URL, url.c_str()) != CURLE_OK) throw std::bad_alloc();
  const CURLcode code = curl_easy_perform(easy.get());
  if (code != CURLE_OK) return {0, failure_reason(code, request, error)};
  long status = 0;
  curl_easy_getinfo(easy.get(), CURLINFO_RESPONSE_CODE, &status);
  return {static_cast<int>(status), {}};
}

}  // namespace webhooks
