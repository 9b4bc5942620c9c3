#include "tests/support/postgres_server.h"

namespace {

std::string name_in(const std::string& uri) {
  const std::size_t begin = uri.rfind('/', uri.find('?')) + 1;
  return uri.substr(begin, uri.find('?') - begin);
}

}  // namespace

PostgresServer& PostgresServer::shared() {
  static PostgresServer server;
  return server;
}

std::string PostgresServer::new_database() { return program_.send_line("new"); }

std::string PostgresServer::copy_database(const std::string& uri) { return program_.send_line("copy " + name_in(uri)); }

std::string PostgresServer::sql(const std::string& uri, const std::string& statement) {
  return program_.send_line("sql " + name_in(uri) + " " + statement);
}

void PostgresServer::stop() { program_.send_line("stop"); }
void PostgresServer::kill() { program_.send_line("kill"); }
void PostgresServer::start() { program_.send_line("start"); }
