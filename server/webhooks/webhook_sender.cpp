#include "server/webhooks/webhook_sender.h"

#include <curl/curl.h>
#include <sys/socket.h>

#include <array>
#include <memory>
#include <new>
#include <optional>

namespace webhooks {
namespace {

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
