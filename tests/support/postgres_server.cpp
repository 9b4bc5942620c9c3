#include "tests/support/postgres_server.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <stdexcept>

PostgresServer& PostgresServer::shared() {
  static PostgresServer server;
  return server;
}

PostgresServer::PostgresServer() {
  std::array<int, 2> to{}, from{};
  if (pipe2(to.data(), O_CLOEXEC) < 0 || pipe2(from.data(), O_CLOEXEC) < 0) throw std::runtime_error("pipe2");
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, to[0], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, from[1], STDOUT_FILENO);
  std::string program = "/usr/bin/python3", script = WHITTLE_SOURCE_DIR "/tests/support/postgres.py";
  const std::array<char*, 3> arguments{program.data(), script.data(), nullptr};
  const int failure = posix_spawn(&pid_, program.c_str(), &files, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  close(to[0]);
  close(from[1]);
  requests_ = to[1];
  answers_ = fdopen(from[0], "r");
  if (failure != 0) throw std::runtime_error("cannot start " + script);
  read_line();
}

PostgresServer::~PostgresServer() {
  close(requests_);
  waitpid(pid_, nullptr, 0);
  std::fclose(answers_);
}

std::string PostgresServer::new_database() { return send_line("new"); }

std::string PostgresServer::sql(const std::string& uri, const std::string& statement) {
  const std::size_t begin = uri.rfind('/', uri.find('?')) + 1;
  return send_line("sql " + uri.substr(begin, uri.find('?') - begin) + " " + statement);
}

void PostgresServer::stop() { send_line("stop"); }
void PostgresServer::start() { send_line("start"); }

std::string PostgresServer::send_line(const std::string& line) {
  const std::string request = line + "\n";
  if (write(requests_, request.data(), request.size()) != static_cast<ssize_t>(request.size()))
    throw std::runtime_error("the PostgreSQL server of the tests has ended");
  return read_line();
}

std::string PostgresServer::read_line() {
  std::string line;
  for (int c = 0; (c = std::fgetc(answers_)) != '\n';) {
    if (c == EOF) throw std::runtime_error("the PostgreSQL server of the tests has ended");
    line += static_cast<char>(c);
  }
  return line;
}
