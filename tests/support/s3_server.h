#pragma once
/// The private S3-compatible server of a test program (tests/support/s3.py), which ends with it. It checks signatures
/// with botocore.

#include <cstdlib>
#include <string>

#include "server/storage/s3/s3_client.h"
#include "tests/support/server_program.h"

class S3Server {
 public:
  /// One for all tests of the program, started at the first call.
  static S3Server& shared() {
    static S3Server server;
    return server;
  }

  /// Settings of a new, empty prefix of its bucket. Sets the variables of the credentials.
  /// With WHITTLE_S3_ENDPOINT the prefix is in the same bucket of that server, and commands do not concern it.
  storage::s3::S3Settings settings() {
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
  std::string command(const std::string& line) { return program_.send_line(line); }  ///< see s3.py

 private:
  ServerProgram program_{"s3.py"};
  int prefixes_ = 0;
};
