#include "server/storage/s3/presigned_url.h"

#include "server/support/text_values.h"
#include "tracer/sha256.h"

namespace storage::s3 {
std::string presigned(const std::string& url, const std::string& region, const Credentials& credentials,
                      std::chrono::seconds seconds, std::time_t now, Parameters parameters) {
  const std::size_t host = url.find("://") + 3, path = url.find('/', host);
  const std::string date = support::in_utc(now, "%Y%m%d"), time = support::in_utc(now, "%Y%m%dT%H%M%SZ");
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
  for (const std::string& part : {date, region, std::string("s3"), std::string("aws4_request")})
    key = tracer::hmac_sha256(key, part);
  return url + "?" + query + "&X-Amz-Signature=" + tracer::hex_of(tracer::hmac_sha256(key, text));
}

}  // namespace storage::s3
