#include "server/webhooks/poster.h"

#include <curl/curl.h>
#include <sys/socket.h>

#include <array>
#include <memory>
#include <new>
#include <optional>

namespace webhooks {
namespace {

/// What the callbacks of one request know.
struct Call {
  const PosterSettings& settings;
  const std::atomic<bool>& stop;
  std::size_t received = 0;
  std::string refused_address;
};

/// Connecting happens here and nowhere else, so what is checked is what is connected to.
curl_socket_t open_socket(void* context, curlsocktype, curl_sockaddr* target) {
  auto& call = *static_cast<Call*>(context);
  const auto address = address_of(&target->addr, target->addrlen);
  if (!address || !call.settings.networks.allow(*address)) {
    call.refused_address = address ? text_of(*address) : "of no known kind";
    return CURL_SOCKET_BAD;
  }
  return ::socket(target->family, target->socktype | SOCK_CLOEXEC, target->protocol);
}

/// Of heads and bodies alike: counted and dropped. Taking less than was given ends the request.
std::size_t drop_received(const char*, std::size_t size, std::size_t count, void* context) {
  auto& call = *static_cast<Call*>(context);
  call.received += size * count;
  return call.received <= call.settings.answer_bytes_max ? size * count : 0;
}

int check_stop(void* context, curl_off_t, curl_off_t, curl_off_t, curl_off_t) {
  return static_cast<Call*>(context)->stop ? 1 : 0;
}

struct FreeEasy {
  void operator()(CURL* easy) const { curl_easy_cleanup(easy); }
};
struct FreeList {
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};
using List = std::unique_ptr<curl_slist, FreeList>;

List list_of(const WebhookSender::Headers& headers) {
  List list;
  for (const auto& [name, value] : headers) {
    const std::string line = std::string(name).append(": ").append(value);
    curl_slist* longer = curl_slist_append(list.get(), line.c_str());
    if (longer == nullptr) throw std::bad_alloc();
    (void)list.release();
    list.reset(longer);
  }
  return list;
}

void set_options(CURL* easy, Call& call) {
  const auto set = [&](CURLoption option, auto value) {
    if (curl_easy_setopt(easy, option, value) != CURLE_OK) throw std::bad_alloc();
  };
  set(CURLOPT_PROTOCOLS_STR, "http,https");
  set(CURLOPT_FOLLOWLOCATION, 0L);
  set(CURLOPT_PROXY, "");  // not even from the environment
  set(CURLOPT_NOSIGNAL, 1L);
  set(CURLOPT_FRESH_CONNECT, 1L);
  set(CURLOPT_FORBID_REUSE, 1L);
  set(CURLOPT_HTTP_VERSION, static_cast<long>(CURL_HTTP_VERSION_1_1));
  set(CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(call.settings.connect_timeout.count()));
  set(CURLOPT_TIMEOUT_MS, static_cast<long>(call.settings.timeout.count()));
  set(CURLOPT_OPENSOCKETFUNCTION, &open_socket);
  set(CURLOPT_OPENSOCKETDATA, static_cast<void*>(&call));
  set(CURLOPT_WRITEFUNCTION, &drop_received);
  set(CURLOPT_WRITEDATA, static_cast<void*>(&call));
  set(CURLOPT_HEADERFUNCTION, &drop_received);
  set(CURLOPT_HEADERDATA, static_cast<void*>(&call));
  set(CURLOPT_XFERINFOFUNCTION, &check_stop);
  set(CURLOPT_XFERINFODATA, static_cast<void*>(&call));
  set(CURLOPT_NOPROGRESS, 0L);
}

std::string why(CURLcode code, const Call& call, const std::array<char, CURL_ERROR_SIZE>& error) {
  if (!call.refused_address.empty()) {
    return "the address " + call.refused_address + " is not public, and no network of the option webhook_networks";
  }
  if (call.received > call.settings.answer_bytes_max) {
    return "the answer has more than " + std::to_string(call.settings.answer_bytes_max) + " bytes";
  }
  return error.front() != '\0' ? error.data() : curl_easy_strerror(code);
}

}  // namespace

WebhookSender::WebhookSender(PosterSettings settings) : settings_(std::move(settings)) {
  if (curl_global_init(CURL_GLOBAL_DEFAULT) != CURLE_OK) throw std::bad_alloc();
}
WebhookSender::~WebhookSender() { curl_global_cleanup(); }

Answer WebhookSender::post(const std::string& url, const Headers& headers, const std::string& body,
                           const std::atomic<bool>& stop) const {
  const std::unique_ptr<CURL, FreeEasy> easy(curl_easy_init());
  if (easy == nullptr) throw std::bad_alloc();
  Call call{settings_, stop, 0, {}};
  set_options(easy.get(), call);
  Headers all = headers;
  all.emplace_back("Expect", "");  // no waiting for a 100
  const List list = list_of(all);
  std::array<char, CURL_ERROR_SIZE> error{};
  curl_easy_setopt(easy.get(), CURLOPT_ERRORBUFFER, error.data());
  curl_easy_setopt(easy.get(), CURLOPT_HTTPHEADER, list.get());
  curl_easy_setopt(easy.get(), CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(body.size()));
  curl_easy_setopt(easy.get(), CURLOPT_POSTFIELDS, body.data());
  if (curl_easy_setopt(easy.get(), CURLOPT_URL, url.c_str()) != CURLE_OK) throw std::bad_alloc();
  const CURLcode code = curl_easy_perform(easy.get());
  if (code != CURLE_OK) return {0, why(code, call, error)};
  long status = 0;
  curl_easy_getinfo(easy.get(), CURLINFO_RESPONSE_CODE, &status);
  return {static_cast<int>(status), {}};
}

}  // namespace webhooks
