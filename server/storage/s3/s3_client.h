#pragma once
/// Objects of one bucket of an S3-compatible store: immutable bytes under keys.

#include <chrono>
#include <cstdint>
#include <ctime>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/storage/s3/s3_credentials.h"
#include "server/storage/s3/s3_http.h"
#include "tracer/result.h"

namespace storage::s3 {

/// A bucket and the prefix of all keys in it.
struct Location {
  std::string bucket;
  std::string prefix;  ///< empty, or ends with /

  /// s3://BUCKET or s3://BUCKET/PREFIX; else the rule that `uri` violates. Buckets have 3 to 63 of a-z 0-9 . - and
  /// prefixes characters that need no encoding: A-Z a-z 0-9 - . _ ~ and single / between them.
  static tracer::Result<Location, std::string> parse(const std::string& uri);
};

struct S3Settings {
  std::string endpoint;  ///< http://HOST:PORT or https://HOST; empty: https://s3.REGION.amazonaws.com
  std::string region = "us-east-1";
  bool path_style = false;  ///< ENDPOINT/BUCKET/KEY and not BUCKET.ENDPOINT/KEY
  Location location;
  std::string credentials_file;  ///< CredentialSource
  /// Larger objects are sent in parts of this size: 16 MiB stay in memory, and 10,000 parts, the most that S3 takes,
  /// are 156 GiB.
  std::uint64_t part_bytes = 16u << 20;
  std::chrono::milliseconds first_pause{100};  ///< before the second try; each further pause is twice as long
  int tries = 6;  ///< for each request: pauses of 3 s together outlast a restart of a proxy
  std::chrono::milliseconds probe_pause{1000};  ///< see S3Client
};

/// Thread-safe. A request that gets no answer, 408, 409, 429 or 5xx is repeated. Every function throws
/// queue::StoreFailure with the key, the status and the message of the store when that did not help, or at once where
/// repeating cannot help: of kind `full` where a quota is used up, else `unavailable`. Keys are relative to the prefix
/// of the location.
///
/// After a request that got no answer at any try, one request each `probe_pause` is sent, once, until one gets an
/// answer; all others fail at once. So callers do not block while the store is unreachable.
class S3Client {
 public:
  explicit S3Client(S3Settings settings);

  /// Throws unless the bucket exists and the credentials may list it. Changes nothing.
  void check();

  /// Bytes of the source at `offset`, up to `size`; fewer only at the end.
  using ReadAt = std::function<std::size_t(std::uint64_t offset, char* into, std::size_t size)>;
  /// Stores an object, also in place of another one. It is durable and visible to all when this returns, and never in
  /// part.
  void put(const std::string& key, std::uint64_t bytes, const ReadAt& read);

  struct Piece {
    std::string bytes;
    std::uint64_t object_bytes = 0;  ///< size of the whole object
  };
  /// Up to `size` bytes at `offset`, fewer only at the end. Nothing where the key does not exist.
  std::optional<Piece> get(const std::string& key, std::uint64_t offset, std::size_t size);

  std::optional<std::uint64_t> bytes_of(const std::string& key);  ///< nothing where the key does not exist
  /// No effect where it does not exist. Ends within 9 s, for callers that hold a lock.
  void remove(const std::string& key);

  struct Listed {
    std::string key;
    std::uint64_t bytes = 0;
  };
  /// Up to 1,000 objects whose keys begin with `prefix` and come after `after`, in the order of keys; fewer only at the
  /// end.
  std::vector<Listed> list(const std::string& prefix, const std::string& after);

  /// Deletes the parts of uploads of keys that begin with `prefix` and that were started before `then`, an ISO 8601
  /// time in UTC ("2025-01-31T23:59:59"). Returns their number, at most 1,000.
  int abort_uploads(const std::string& prefix, const std::string& then);

  /// A URL that reads an object without credentials for `seconds` (at most a week) from `now`. `parameters` may set
  /// headers of the answer, such as response-content-type. Sends no request; libcurl does not sign queries.
  /// https://docs.aws.amazon.com/AmazonS3/latest/API/sigv4-query-string-auth.html
  [[nodiscard]] std::string presigned_url(const std::string& key, std::chrono::seconds seconds, std::time_t now,
                                          Parameters parameters = {}) const;

 private:
  [[nodiscard]] std::string url_of(const std::string& key) const;
  HttpAnswer send(HttpRequest request);
  int admit(int tries);
  void set_reached(bool reached, const std::string& failure);
  void put_whole(const std::string& key, std::string bytes);
  void abort_upload(const std::string& key, const std::string& upload);
  void put_parts(const std::string& key, std::uint64_t bytes, const ReadAt& read, const std::string& upload);

  S3Settings settings_;
  CredentialSource credentials_;
  std::string base_url_;  ///< URL of the bucket, ends with /
  SignedHttp http_;
  std::mutex mutex_;                                  ///< guards the next
  std::string failure_;                               ///< while the store is away
  std::chrono::steady_clock::time_point next_probe_;  ///< the next request that is sent then
};

}  // namespace storage::s3
