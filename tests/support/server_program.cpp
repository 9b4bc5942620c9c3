#include "tests/support/server_program.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <stdexcept>

ServerProgram::ServerProgram(const std::string& file) : file_(file) {
  std::array<int, 2> to{}, from{};
  if (pipe2(to.data(), O_CLOEXEC) < 0 || pipe2(from.data(), O_CLOEXEC) < 0) throw std::runtime_error("pipe2");
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, to[0], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&files, from[1], STDOUT_FILENO);
  std::string program = "/usr/bin/python3", script = WHITTLE_SOURCE_DIR "/tests/support/" + file;
  const std::array<char*, 3> arguments{program.data(), script.data(), nullptr};
  const int failure = posix_spawn(&pid_, program.c_str(), &files, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  close(to[0]);
  close(from[1]);
  requests_ = to[1];
  answers_ = fdopen(from[0], "r");
  if (failure != 0) throw std::runtime_error("cannot start " + script);
  ready_ = read_line();
}

ServerProgram::~ServerProgram() {
  close(requests_);
  waitpid(pid_, nullptr, 0);
  std::fclose(answers_);
}

std::string ServerProgram::send_line(const std::string& line) {
  const std::string request = line + "\n";
  if (write(requests_, request.data(), request.size()) != static_cast<ssize_t>(request.size()))
    throw std::runtime_error(file_ + " has ended");
  return read_line();
}

std::string ServerProgram::read_line() {
  std::string line;
  for (int c = 0; (c = std::fgetc(answers_)) != '\n';) {
    if (c == EOF) throw std::runtime_error(file_ + " has ended");
    line += static_cast<char>(c);
  }
  return line;
}
