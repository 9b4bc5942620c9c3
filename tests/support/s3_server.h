#pragma once
/// The private S3-compatible server of a test program (tests/support/s3.py), which ends with it. It checks signatures
/// with botocore.

#include <string>

#include "server/storage/s3/s3_client.h"
#include "tests/support/server_program.h"

class S3Server {
 public:
  static S3Server& shared();  ///< one for all tests of the program, started at the first call

  /// Settings of a new, empty prefix of its bucket. Sets the variables of the credentials.
  /// With WHITTLE_S3_ENDPOINT the prefix is in the same bucket of that server, and commands do not concern it.
  storage::s3::S3Settings settings();
  std::string command(const std::string& line) { return program_.send_line(line); }  ///< see s3.py

 private:
  ServerProgram program_{"s3.py"};
  int prefixes_ = 0;
};
