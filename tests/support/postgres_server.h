#pragma once
/// The private PostgreSQL server of a test program (tests/support/postgres.py), which ends with it.

#include <gtest/gtest.h>

#include <string>

#include "tests/support/server_program.h"

class PostgresServer {
 public:
  /// One for all tests of the program, started at the first call.
  static PostgresServer& shared() {
    static PostgresServer server;
    return server;
  }

  std::string new_database() { return program_.send_line("new"); }  ///< its connection URI
  /// Copies the database of a URI, which has no sessions; the URI of the copy.
  std::string copy_database(const std::string& uri) { return program_.send_line("copy " + name_in(uri)); }
  /// Runs a statement in the database of a URI; its rows, separated by blanks.
  std::string sql(const std::string& uri, const std::string& statement) {
    return program_.send_line("sql " + name_in(uri) + " " + statement);
  }
  void stop() { program_.send_line("stop"); }
  void kill() { program_.send_line("kill"); }  ///< without a checkpoint
  void start() { program_.send_line("start"); }

 private:
  static std::string name_in(const std::string& uri) {
    const std::size_t begin = uri.rfind('/', uri.find('?')) + 1;
    return uri.substr(begin, uri.find('?') - begin);
  }

  ServerProgram program_{"postgres.py"};
};

/// Tests of which each has an empty database.
class PostgresTest : public testing::Test {
 protected:
  PostgresServer& server = PostgresServer::shared();
  const std::string uri = server.new_database();
};
