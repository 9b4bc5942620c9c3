#pragma once
/// The private PostgreSQL server of a test program (tests/support/postgres.py), which ends with it.

#include <cstdio>
#include <string>

class PostgresServer {
 public:
  static PostgresServer& shared();  ///< one for all tests of the program, started at the first call

  PostgresServer();
  ~PostgresServer();
  PostgresServer(const PostgresServer&) = delete;
  PostgresServer& operator=(const PostgresServer&) = delete;

  std::string new_database();  ///< its connection URI
  /// Runs a statement in the database of a URI; its rows, separated by blanks.
  std::string sql(const std::string& uri, const std::string& statement);
  void stop();
  void start();

 private:
  std::string send_line(const std::string& line);
  std::string read_line();

  int requests_ = -1;
  std::FILE* answers_ = nullptr;
  int pid_ = -1;
};
