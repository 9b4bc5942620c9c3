#pragma once
/// A server of a test program: a Python file of tests/support that prints a line when it is ready, then answers each
/// line of its standard input with one line, and ends when that is closed.

#include <cstdio>
#include <string>

class ServerProgram {
 public:
  explicit ServerProgram(const std::string& file);  ///< relative to tests/support
  ~ServerProgram();
  ServerProgram(const ServerProgram&) = delete;
  ServerProgram& operator=(const ServerProgram&) = delete;

  [[nodiscard]] const std::string& ready() const { return ready_; }  ///< its first line
  std::string send_line(const std::string& line);                    ///< the answer

 private:
  std::string read_line();

  std::string file_;
  int requests_ = -1;
  std::FILE* answers_ = nullptr;
  int pid_ = -1;
  std::string ready_;
};
