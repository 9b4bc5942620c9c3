#include "server/storage/s3/presigned_url.h"

#include <openssl/evp.h>
#include <openssl/hmac.h>

#include <array>

#include "tracer/sha256.h"

namespace storage::s3 {
namespace {

std::string hmac(const std::string& key, const std::string& text) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()), reinterpret_cast<const unsigned char*>(text.data()),
       text.size(), digest.data(), &size);
  return {reinterpret_cast<const char*>(digest.data()), size};
}

std::string hex(const std::string& bytes) {
  constexpr const char* digits = "0123456789abcdef";
  std::string text;
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    text += {digits[byte >> 4], digits[byte & 15]};
  }
  return text;
}

std::string in_utc(std::time_t time, const char* format) {
  std::tm utc{};
  gmtime_r(&time, &utc);
  std::array<char, 32> text{};
  return {text.data(), std::strftime(text.data(), text.size(), format, &utc)};
}

}  // namespace

std::string presigned(const std::string& url, const std::string& region, const Credentials& credentials,
                      std::chrono::seconds seconds, std::time_t now, Parameters parameters) {
  const std::size_t host = url.find("://") + 3, path = url.find('/', host);
  const std::string date = in_utc(now, "%Y%m%d"), time = in_utc(now, "%Y%m%dT%H%M%SZ");
  const std::string scope = date + "/" + region + "/s3/aws4_request";
  parameters.emplace_back("X-Amz-Algorithm", "AWS4-HMAC-SHA256");
  parameters.emplace_back("X-Amz-Credential", credentials.access_key + "/" + scope);
  parameters.emplace_back("X-Amz-Date", time);
  parameters.emplace_back("X-Amz-Expires", std::to_string(seconds.count()));
  parameters.emplace_back("X-Amz-SignedHeaders", "host");
  if (!credentials.session_token.empty()) parameters.emplace_back("X-Amz-Security-Token", credentials.session_token);
  const std::string query = query_of(std::move(parameters));
  const std::string canonical = "GET\n" + url.substr(path) + "\n" + query + "\nhost:" + url.substr(host, path - host) +
                                "\n\nhost\nUNSIGNED-PAYLOAD";
  const std::string text = "AWS4-HMAC-SHA256\n" + time + "\n" + scope + "\n" + tracer::sha256_hex(canonical);
  std::string key = "AWS4" + credentials.secret_key;
  for (const std::string& part : {date, region, std::string("s3"), std::string("aws4_request")}) key = hmac(key, part);
  return url + "?" + query + "&X-Amz-Signature=" + hex(hmac(key, text));
}

}  // namespace storage::s3
