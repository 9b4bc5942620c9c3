#include "server/storage/s3/s3_http.h"

#include <curl/curl.h>

#include <algorithm>
#include <array>
#include <new>

#include "tracer/sha256.h"

namespace storage::s3 {
namespace {

struct Exchange {
  const HttpRequest& request;
  HttpAnswer answer;
};

/// Accepting fewer bytes than given ends the request.
std::size_t receive_body(const char* bytes, std::size_t size, std::size_t count, void* context) {
  auto& exchange = *static_cast<Exchange*>(context);
  if (exchange.answer.body.size() + size * count > exchange.request.answer_bytes_max) return 0;
  exchange.answer.body.append(bytes, size * count);
  return size * count;
}

std::string header_of(CURL* easy, const char* name) {
  curl_header* header = nullptr;
  return curl_easy_header(easy, name, 0, CURLH_HEADER, -1, &header) == CURLHE_OK ? header->value : "";
}

using List = std::unique_ptr<curl_slist, decltype(&curl_slist_free_all)>;

List list_of(const Parameters& headers) {
  List list(nullptr, &curl_slist_free_all);
  for (const auto& [name, value] : headers) {
    std::string line = name;
    line.append(": ").append(value);
    curl_slist* longer = curl_slist_append(list.get(), line.c_str());
    if (longer == nullptr) throw std::bad_alloc();
    (void)list.release();
    list.reset(longer);
  }
  return list;
}

template <class Value>
void set(CURL* easy, CURLoption option, Value value) {
  if (curl_easy_setopt(easy, option, value) != CURLE_OK) throw std::bad_alloc();
}

/// The method and the body. `Expect: 100-continue` stays as libcurl sends it: removing it would sign what is not sent.
void set_method(CURL* easy, const HttpRequest& request) {
  if (request.method == "HEAD") set(easy, CURLOPT_NOBODY, 1L);
  if (request.method == "HEAD" || request.method == "GET") return;
  if (request.method != "DELETE") {
    set(easy, CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(request.body.size()));
    set(easy, CURLOPT_POSTFIELDS, request.body.data());
  }
  set(easy, CURLOPT_CUSTOMREQUEST, request.method.c_str());
}

void set_transport(CURL* easy, const HttpSettings& settings, Exchange& exchange) {
  set(easy, CURLOPT_URL, exchange.request.url.c_str());
  set(easy, CURLOPT_PATH_AS_IS, 1L);
  set(easy, CURLOPT_PROTOCOLS_STR, "http,https");
  set(easy, CURLOPT_PROXY, "");  // ignores the environment
  set(easy, CURLOPT_NOSIGNAL, 1L);
  set(easy, CURLOPT_HTTP_VERSION, static_cast<long>(CURL_HTTP_VERSION_1_1));
  set(easy, CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(settings.connect_timeout.count()));
  set(easy, CURLOPT_LOW_SPEED_LIMIT, 1L);
  set(easy, CURLOPT_LOW_SPEED_TIME, static_cast<long>(settings.stall.count()));
  set(easy, CURLOPT_TIMEOUT_MS, static_cast<long>(exchange.request.timeout.count()));
  set(easy, CURLOPT_WRITEFUNCTION, &receive_body);
  set(easy, CURLOPT_WRITEDATA, static_cast<void*>(&exchange));
  if (!exchange.request.range.empty()) set(easy, CURLOPT_RANGE, exchange.request.range.c_str());
}

}  // namespace

std::string percent_encoded(const std::string& text) {
  const std::unique_ptr<char, decltype(&curl_free)> encoded(
      curl_easy_escape(nullptr, text.data(), static_cast<int>(text.size())), &curl_free);
  if (!encoded) throw std::bad_alloc();
  return encoded.get();
}

std::string query_of(Parameters parameters) {
  std::ranges::sort(parameters);
  std::string query;
  for (const auto& [name, value] : parameters) {
    if (!query.empty()) query += '&';
    query += percent_encoded(name) + "=" + percent_encoded(value);
  }
  return query;
}

SignedHttp::~SignedHttp() {
  for (CURL* connection : idle_) curl_easy_cleanup(connection);
}

CURL* SignedHttp::take() {
  {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      CURL* connection = idle_.back();
      idle_.pop_back();
      return connection;
    }
  }
  CURL* connection = curl_easy_init();
  if (connection == nullptr) throw std::bad_alloc();
  return connection;
}

void SignedHttp::release(CURL* connection) {
  curl_easy_reset(connection);  // keeps the open connection
  const std::lock_guard lock(mutex_);
  idle_.push_back(connection);
}

HttpAnswer SignedHttp::send(const HttpRequest& request, const Credentials& credentials) {
  const auto end = [this](CURL* connection) { release(connection); };
  const std::unique_ptr<CURL, decltype(end)> easy(take(), end);
  Exchange exchange{request, {}};
  set_transport(easy.get(), settings_, exchange);
  set_method(easy.get(), request);
  set(easy.get(), CURLOPT_AWS_SIGV4, ("aws:amz:" + settings_.region + ":s3").c_str());
  set(easy.get(), CURLOPT_USERNAME, credentials.access_key.c_str());
  set(easy.get(), CURLOPT_PASSWORD, credentials.secret_key.c_str());
  Parameters headers{{"x-amz-content-sha256", tracer::sha256_hex(request.body)}};
  if (!credentials.session_token.empty()) headers.emplace_back("x-amz-security-token", credentials.session_token);
  if (request.method == "PUT") headers.emplace_back("Content-Type", "binary/octet-stream");  // as without a type
  if (request.method == "POST") headers.emplace_back("Content-Type", "application/xml");
  const List list = list_of(headers);
  set(easy.get(), CURLOPT_HTTPHEADER, list.get());
  std::array<char, CURL_ERROR_SIZE> error{};
  set(easy.get(), CURLOPT_ERRORBUFFER, error.data());
  const CURLcode code = curl_easy_perform(easy.get());
  if (code != CURLE_OK) {
    exchange.answer.failure = error.front() != '\0' ? error.data() : curl_easy_strerror(code);
    return exchange.answer;
  }
  long status = 0;
  curl_off_t length = -1;
  curl_easy_getinfo(easy.get(), CURLINFO_RESPONSE_CODE, &status);
  curl_easy_getinfo(easy.get(), CURLINFO_CONTENT_LENGTH_DOWNLOAD_T, &length);
  exchange.answer.status = static_cast<int>(status);
  exchange.answer.etag = header_of(easy.get(), "etag");
  exchange.answer.content_range = header_of(easy.get(), "content-range");
  exchange.answer.content_length = length < 0 ? 0 : static_cast<std::uint64_t>(length);
  return std::move(exchange.answer);
}

}  // namespace storage::s3
