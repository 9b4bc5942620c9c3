#include "server/storage/s3/s3_credentials.h"

#include <cstdlib>
#include <fstream>

#include "server/queue/job_store.h"
#include "server/support/text_values.h"

namespace storage::s3 {
namespace {

std::string variable(const char* name) {
  const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): nothing in the daemon changes it
  return value == nullptr ? "" : value;
}

Credentials from_environment() {
  return {variable("AWS_ACCESS_KEY_ID"), variable("AWS_SECRET_ACCESS_KEY"), variable("AWS_SESSION_TOKEN")};
}

Credentials from_file(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw queue::StoreFailure("cannot read the credentials in " + path);
  Credentials credentials;
  bool is_default = true;
  for (std::string whole; std::getline(file, whole);) {
    const std::string_view line = support::trimmed(whole);
    if (line.starts_with('[')) is_default = line == "[default]";
    const std::size_t equals = line.find('=');
    if (!is_default || equals == std::string::npos || line.starts_with('#')) continue;
    const std::string_view name = support::trimmed(line.substr(0, equals));
    const std::string value(support::trimmed(line.substr(equals + 1)));
    if (name == "aws_access_key_id") credentials.access_key = value;
    if (name == "aws_secret_access_key") credentials.secret_key = value;
    if (name == "aws_session_token") credentials.session_token = value;
  }
  return credentials;
}

}  // namespace

Credentials CredentialSource::get() const {
  Credentials credentials = file_.empty() ? from_environment() : from_file(file_);
  if (credentials.access_key.empty() || credentials.secret_key.empty()) {
    throw queue::StoreFailure(file_.empty() ? "AWS_ACCESS_KEY_ID or AWS_SECRET_ACCESS_KEY is not set"
                                            : file_ + " has no aws_access_key_id or no aws_secret_access_key");
  }
  return credentials;
}

}  // namespace storage::s3
