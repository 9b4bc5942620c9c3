#pragma once
/// Signed HTTP requests to an S3-compatible store, over connections that are kept. Private to server/storage/s3.

#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/storage/s3/s3_credentials.h"

using CURL = void;  // as curl/curl.h

namespace storage::s3 {

/// Names and values, not encoded.
using Parameters = std::vector<std::pair<std::string, std::string>>;

/// All but A-Z a-z 0-9 - . _ ~ as %XX (RFC 3986 section 2.3), as signatures need it.
std::string percent_encoded(const std::string& text);

/// name=value joined by &, encoded and sorted, with = also after names without a value.
std::string query_of(Parameters parameters);

struct HttpRequest {
  std::string method;                    ///< GET, HEAD, PUT, POST or DELETE
  std::string url;                       ///< whole, encoded
  std::string range = {};                ///< "0-99"; empty: none
  std::string body = {};                 ///< for PUT and POST
  std::chrono::milliseconds timeout{0};  ///< for the whole request; 0: none
  std::size_t answer_bytes_max = 0;  ///< limit for the body of an answer; a longer one is a failure of the transport
};

struct HttpAnswer {
  int status = 0;  ///< 0: no answer
  std::string body, etag, content_range;
  std::uint64_t content_length = 0;
  std::string failure;  ///< reason of the transport, when there is no answer
};

struct HttpSettings {
  std::string region;
  std::chrono::milliseconds connect_timeout{2000};  ///< as for the database
  std::chrono::seconds stall{10};  ///< without a byte in either direction; a store may take seconds before it answers
};

/// Thread-safe. Signs with the Signature Version 4 of libcurl and names the hash of the body, which the store compares.
class SignedHttp {
 public:
  explicit SignedHttp(HttpSettings settings) : settings_(std::move(settings)) {}
  ~SignedHttp();
  SignedHttp(SignedHttp&&) = delete;

  /// Sends once. Never throws but bad_alloc.
  HttpAnswer send(const HttpRequest& request, const Credentials& credentials);

 private:
  CURL* take();
  void release(CURL* connection);

  HttpSettings settings_;
  std::mutex mutex_;
  std::vector<CURL*> idle_;
};

}  // namespace storage::s3
