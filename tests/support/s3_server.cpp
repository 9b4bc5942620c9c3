#include "tests/support/s3_server.h"

#include <cstdlib>

S3Server& S3Server::shared() {
  static S3Server server;
  return server;
}

storage::s3::S3Settings S3Server::settings() {
  setenv("AWS_ACCESS_KEY_ID", "whittle-key", 1);          // NOLINT(concurrency-mt-unsafe): before threads start
  setenv("AWS_SECRET_ACCESS_KEY", "whittle/secret+", 1);  // NOLINT(concurrency-mt-unsafe)
  storage::s3::S3Settings settings;
  const char* const other = std::getenv("WHITTLE_S3_ENDPOINT");  // NOLINT(concurrency-mt-unsafe)
  settings.endpoint = other == nullptr ? program_.ready() : other;
  settings.path_style = true;
  settings.location = {"whittle", "test" + std::to_string(++prefixes_) + "/"};
  settings.first_pause = settings.probe_pause = std::chrono::milliseconds(5);
  return settings;
}
