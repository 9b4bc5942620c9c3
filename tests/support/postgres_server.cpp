#include "tests/support/postgres_server.h"

PostgresServer& PostgresServer::shared() {
  static PostgresServer server;
  return server;
}

std::string PostgresServer::new_database() { return program_.send_line("new"); }

std::string PostgresServer::sql(const std::string& uri, const std::string& statement) {
  const std::size_t begin = uri.rfind('/', uri.find('?')) + 1;
  return program_.send_line("sql " + uri.substr(begin, uri.find('?') - begin) + " " + statement);
}

void PostgresServer::stop() { program_.send_line("stop"); }
void PostgresServer::start() { program_.send_line("start"); }
