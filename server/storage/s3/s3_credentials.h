#pragma once
/// Credentials of an S3-compatible store, from the usual variables or a file in the format of the AWS tools.

#include <string>
#include <utility>

namespace storage::s3 {

struct Credentials {
  std::string access_key, secret_key;
  std::string session_token;  ///< empty: none
};

/// Thread-safe.
class CredentialSource {
 public:
  /// `file`: empty for AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and AWS_SESSION_TOKEN of the environment.
  explicit CredentialSource(std::string file) : file_(std::move(file)) {}

  /// Reads the file at each call, since temporary credentials are replaced while the daemon runs; it is some hundred
  /// bytes. Uses the section `default`, or the lines before the first section. Throws queue::StoreFailure where a key
  /// is missing or the file cannot be read.
  [[nodiscard]] Credentials get() const;

 private:
  std::string file_;
};

}  // namespace storage::s3
