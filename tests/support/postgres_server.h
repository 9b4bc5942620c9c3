#pragma once
/// The private PostgreSQL server of a test program (tests/support/postgres.py), which ends with it.

#include <string>

#include "tests/support/server_program.h"

class PostgresServer {
 public:
  static PostgresServer& shared();  ///< one for all tests of the program, started at the first call

  std::string new_database();  ///< its connection URI
  /// Copies the database of a URI, which has no sessions; the URI of the copy.
  std::string copy_database(const std::string& uri);
  /// Runs a statement in the database of a URI; its rows, separated by blanks.
  std::string sql(const std::string& uri, const std::string& statement);
  void stop();
  void kill();  ///< without a checkpoint
  void start();

 private:
  ServerProgram program_{"postgres.py"};
};
