#include "server/storage/s3/s3_client.h"

#include <curl/curl.h>

#include <algorithm>
#include <new>
#include <pugixml.hpp>
#include <random>
#include <thread>
#include <utility>

#include "server/queue/job_store.h"
#include "server/support/text_values.h"
#include "tracer/sha256.h"

namespace storage::s3 {
namespace {

constexpr std::size_t document_bytes_max = 4u << 20;  // a list of 1,000 keys of 1,024 bytes, escaped

/// The root element of an answer; empty where the body is no XML.
struct Document {
  explicit Document(const std::string& body) { xml.load_buffer(body.data(), body.size()); }
  [[nodiscard]] std::string root() const { return xml.document_element().name(); }
  [[nodiscard]] std::string text(const char* child) const { return xml.document_element().child(child).text().get(); }
  pugi::xml_document xml;
};

std::string error_code(const HttpAnswer& answer) {
  const Document document(answer.body);
  return document.root() == "Error" ? document.text("Code") : "";
}

std::string reason_of(const HttpAnswer& answer) {
  if (answer.status == 0) return answer.failure;
  const Document document(answer.body);
  std::string reason = "status " + std::to_string(answer.status);
  if (document.root() == "Error") reason += ", " + document.text("Code") + ": " + document.text("Message");
  return reason;
}

std::string describe(const HttpRequest& request, const HttpAnswer& answer) {
  return "S3: " + request.method + " " + request.url.substr(0, request.url.find('?')) + ": " + reason_of(answer);
}

[[noreturn]] void fail(const HttpRequest& request, const HttpAnswer& answer) {
  const bool is_full = answer.status == 507 || error_code(answer) == "QuotaExceeded";
  using Kind = queue::StoreFailure::Kind;
  throw queue::StoreFailure(is_full ? Kind::full : Kind::unavailable, describe(request, answer));
}

/// The same request may succeed later.
bool is_transient(const HttpAnswer& answer) {
  return answer.status == 0 || answer.status == 408 || answer.status == 409 || answer.status == 429 ||
         (answer.status >= 500 && answer.status != 507) || error_code(answer) == "RequestTimeout";
}

/// A random part of the pause, so that nodes which lost the store together do not return together.
std::chrono::milliseconds with_jitter(std::chrono::milliseconds pause) {
  thread_local std::minstd_rand random(std::random_device{}());
  return pause / 2 +
         std::chrono::milliseconds(std::uniform_int_distribution<std::int64_t>(0, pause.count() / 2)(random));
}

std::string read_whole(const S3Client::ReadAt& read, std::uint64_t offset, std::uint64_t size) {
  std::string bytes(size, '\0');
  std::size_t filled = 0;
  while (filled < size) {
    const std::size_t count = read(offset + filled, bytes.data() + filled, size - filled);
    if (count == 0) throw queue::StoreFailure("the source became shorter while it was stored");
    filled += count;
  }
  return bytes;
}

std::string base_url(const S3Settings& settings) {
  const std::string endpoint =
      settings.endpoint.empty() ? "https://s3." + settings.region + ".amazonaws.com" : settings.endpoint;
  const std::string& bucket = settings.location.bucket;
  if (settings.path_style) return endpoint + "/" + bucket + "/";
  const std::size_t host = endpoint.find("://") + 3;
  return endpoint.substr(0, host) + bucket + "." + endpoint.substr(host) + "/";
}

bool has_only(const std::string& text, const char* characters) {
  return text.find_first_not_of(characters) == std::string::npos;
}

}  // namespace

tracer::Result<Location, std::string> Location::parse(const std::string& uri) {
  constexpr const char* lower = "abcdefghijklmnopqrstuvwxyz0123456789-.";
  constexpr const char* unreserved = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~/";
  const std::string rule = "must be s3://BUCKET or s3://BUCKET/PREFIX, got \"" + uri + "\"";
  if (!uri.starts_with("s3://")) return rule;
  const std::string rest = uri.substr(5);
  const std::size_t slash = std::min(rest.find('/'), rest.size());
  Location location{rest.substr(0, slash), rest.substr(std::min(slash + 1, rest.size()))};
  std::string& prefix = location.prefix;
  if (!prefix.empty() && !prefix.ends_with('/')) prefix += '/';
  if (location.bucket.size() < 3 || location.bucket.size() > 63 || !has_only(location.bucket, lower)) return rule;
  if (prefix.size() > 512 || prefix.starts_with('/') || prefix.find("//") != std::string::npos) return rule;
  if (!has_only(prefix, unreserved)) return rule;
  if (("/" + prefix).find("/./") != std::string::npos || ("/" + prefix).find("/../") != std::string::npos) return rule;
  return location;
}

S3Client::S3Client(S3Settings settings)
    : settings_(std::move(settings)),
      credentials_(settings_.credentials_file),
      base_url_(base_url(settings_)),
      http_({.region = settings_.region}) {
  static const CURLcode initialized = curl_global_init(CURL_GLOBAL_DEFAULT);
  if (initialized != CURLE_OK) throw std::bad_alloc();
}

std::string S3Client::url_of(const std::string& key) const {
  std::string path = percent_encoded(settings_.location.prefix + key);
  for (std::size_t slash = 0; (slash = path.find("%2F", slash)) != std::string::npos;) path.replace(slash, 3, "/");
  return base_url_ + path;
}

HttpAnswer S3Client::send(HttpRequest request) {
  if (request.answer_bytes_max == 0) request.answer_bytes_max = document_bytes_max;
  int tries_left = admit(request.timeout.count() == 0 ? settings_.tries : 1);
  std::chrono::milliseconds pause = settings_.first_pause;
  for (;;) {
    HttpAnswer answer = http_.send(request, credentials_.get());
    if (answer.status != 0) set_reached(true, {});
    if (!is_transient(answer)) return answer;
    if (--tries_left == 0) {
      if (answer.status == 0) set_reached(false, describe(request, answer));
      fail(request, answer);
    }
    std::this_thread::sleep_for(with_jitter(pause));
    pause *= 2;
    tries_left = std::min(tries_left, admit(tries_left));
  }
}

/// The number of times that a request may be sent. Throws while the store is away and no probe is due.
int S3Client::admit(int tries) {
  const std::lock_guard lock(mutex_);
  if (failure_.empty()) return tries;
  const auto now = std::chrono::steady_clock::now();
  if (now < next_probe_) throw queue::StoreFailure(failure_);
  next_probe_ = now + settings_.probe_pause;
  return 1;
}

void S3Client::set_reached(bool reached, const std::string& failure) {
  const std::lock_guard lock(mutex_);
  failure_ = reached ? std::string() : failure;
  if (!reached) next_probe_ = std::chrono::steady_clock::now() + settings_.probe_pause;
}

void S3Client::check() { (void)list("", ""); }

// ---- write

void S3Client::put(const std::string& key, std::uint64_t bytes, const ReadAt& read) {
  if (bytes <= settings_.part_bytes) return put_whole(key, read_whole(read, 0, bytes));
  const HttpRequest start{.method = "POST", .url = url_of(key) + "?uploads="};
  const HttpAnswer answer = send(start);
  const std::string upload = Document(answer.body).text("UploadId");
  if (answer.status != 200 || upload.empty()) fail(start, answer);
  try {
    put_parts(key, bytes, read, upload);
  } catch (...) {
    try {
      abort_upload(key, upload);
    } catch (const queue::StoreFailure&) {  // NOLINT(bugprone-empty-catch): abort_uploads() deletes it later
    }
    throw;
  }
}

void S3Client::put_whole(const std::string& key, std::string bytes) {
  const HttpRequest request{.method = "PUT", .url = url_of(key), .body = std::move(bytes)};
  const HttpAnswer answer = send(request);
  if (answer.status != 200) fail(request, answer);
}

void S3Client::abort_upload(const std::string& key, const std::string& upload) {
  const HttpRequest request{.method = "DELETE", .url = url_of(key) + "?" + query_of({{"uploadId", upload}})};
  const HttpAnswer answer = send(request);
  if (answer.status != 204 && answer.status != 200 && error_code(answer) != "NoSuchUpload") fail(request, answer);
}

void S3Client::put_parts(const std::string& key, std::uint64_t bytes, const ReadAt& read, const std::string& upload) {
  std::string parts = "<CompleteMultipartUpload>";
  for (std::uint64_t offset = 0, number = 1; offset < bytes; offset += settings_.part_bytes, ++number) {
    const Parameters parameters{{"partNumber", std::to_string(number)}, {"uploadId", upload}};
    const HttpRequest part{.method = "PUT",
                           .url = url_of(key) + "?" + query_of(parameters),
                           .body = read_whole(read, offset, std::min(settings_.part_bytes, bytes - offset))};
    const HttpAnswer answer = send(part);
    if (answer.status != 200) fail(part, answer);
    parts += "<Part><PartNumber>" + std::to_string(number) + "</PartNumber><ETag>" + answer.etag + "</ETag></Part>";
  }
  const HttpRequest end{.method = "POST",
                        .url = url_of(key) + "?" + query_of({{"uploadId", upload}}),
                        .body = parts + "</CompleteMultipartUpload>"};
  const HttpAnswer answer = send(end);
  // The status is sent before the parts are joined: a failure may follow it in the body.
  if (answer.status == 200 && Document(answer.body).root() == "CompleteMultipartUploadResult") return;
  // No such upload: the answer to an earlier try was lost.
  if (error_code(answer) == "NoSuchUpload" && bytes_of(key) == bytes) return;
  fail(end, answer);
}

// ---- read

std::optional<S3Client::Piece> S3Client::get(const std::string& key, std::uint64_t offset, std::size_t size) {
  if (size == 0) return Piece{{}, bytes_of(key).value_or(0)};
  HttpRequest request{
      .method = "GET", .url = url_of(key), .range = std::to_string(offset) + "-" + std::to_string(offset + size - 1)};
  request.answer_bytes_max = std::max(size, document_bytes_max);
  HttpAnswer answer = send(request);
  if (answer.status == 416) return Piece{{}, bytes_of(key).value_or(0)};  // at or behind the end
  if (answer.status == 404 && error_code(answer) == "NoSuchKey") return std::nullopt;
  if (answer.status == 206) {
    const std::uint64_t total =
        support::parse_number<std::uint64_t>(answer.content_range.substr(answer.content_range.find('/') + 1))
            .value_or(0);
    return Piece{std::move(answer.body), total};
  }
  // All of it: some stores send an empty object, or one that is shorter than the range, so.
  if (answer.status == 200 && offset == 0 && answer.body.size() <= size) {
    const std::uint64_t total = answer.body.size();
    return Piece{std::move(answer.body), total};
  }
  fail(request, answer);
}

std::optional<std::uint64_t> S3Client::bytes_of(const std::string& key) {
  const HttpRequest request{.method = "HEAD", .url = url_of(key)};
  const HttpAnswer answer = send(request);
  if (answer.status == 404) return std::nullopt;
  if (answer.status != 200) fail(request, answer);
  return answer.content_length;
}

void S3Client::remove(const std::string& key) {
  const HttpRequest request{.method = "DELETE", .url = url_of(key), .timeout = std::chrono::seconds(9)};
  const HttpAnswer answer = send(request);
  if (answer.status != 204 && answer.status != 200 && error_code(answer) != "NoSuchKey") fail(request, answer);
}

std::vector<S3Client::Listed> S3Client::list(const std::string& prefix, const std::string& after) {
  const std::string& own = settings_.location.prefix;
  Parameters parameters{{"list-type", "2"}, {"prefix", own + prefix}};
  if (!after.empty()) parameters.emplace_back("start-after", own + after);
  const HttpRequest request{.method = "GET", .url = base_url_ + "?" + query_of(parameters)};
  const HttpAnswer answer = send(request);
  const Document document(answer.body);
  if (answer.status != 200 || document.root() != "ListBucketResult") fail(request, answer);
  std::vector<Listed> listed;
  for (const pugi::xml_node& entry : document.xml.document_element().children("Contents")) {
    listed.push_back(
        {std::string(entry.child("Key").text().get()).substr(own.size()), entry.child("Size").text().as_ullong()});
  }
  return listed;
}

int S3Client::abort_uploads(const std::string& prefix, const std::string& then) {
  const std::string& own = settings_.location.prefix;
  const HttpRequest request{.method = "GET",
                            .url = base_url_ + "?" + query_of({{"uploads", ""}, {"prefix", own + prefix}})};
  const HttpAnswer answer = send(request);
  const Document document(answer.body);
  if (answer.status != 200 || document.root() != "ListMultipartUploadsResult") fail(request, answer);
  int aborted = 0;
  for (const pugi::xml_node& entry : document.xml.document_element().children("Upload")) {
    const std::string key = entry.child("Key").text().get(), started = entry.child("Initiated").text().get();
    if (!key.starts_with(own + prefix) || started.empty() || started >= then) continue;
    abort_upload(key.substr(own.size()), entry.child("UploadId").text().get());
    ++aborted;
  }
  return aborted;
}

std::string S3Client::presigned_url(const std::string& key, std::chrono::seconds seconds, std::time_t now,
                                    Parameters parameters) const {
  const std::string url = url_of(key);
  const Credentials credentials = credentials_.get();
  const std::size_t host = url.find("://") + 3, path = url.find('/', host);
  const std::string date = support::in_utc(now, "%Y%m%d"), time = support::in_utc(now, "%Y%m%dT%H%M%SZ");
  const std::string scope = date + "/" + settings_.region + "/s3/aws4_request";
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
  std::string signing_key = "AWS4" + credentials.secret_key;
  for (const std::string& part : {date, settings_.region, std::string("s3"), std::string("aws4_request")})
    signing_key = tracer::hmac_sha256(signing_key, part);
  return url + "?" + query + "&X-Amz-Signature=" + tracer::hex_of(tracer::hmac_sha256(signing_key, text));
}

}  // namespace storage::s3
