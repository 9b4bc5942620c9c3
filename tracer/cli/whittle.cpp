// whittle: the command line of the tracer. `whittle --help` is its manual.
#include <cstdio>
#include <exception>
#include <new>
#include <string>
#include <variant>

#include "tracer/cli/options.h"

cli::ExitCode cli::run(const PrintText& print) {
  const bool printed = std::fputs(print.text.c_str(), stdout) >= 0 && std::fflush(stdout) == 0;
  return printed ? success : environment_failure;  // a full disk, a closed pipe
}

int main(int count, char** arguments) try {
  const auto command = cli::parse_arguments({arguments + (count > 0 ? 1 : 0), arguments + count});
  if (command) return std::visit([](const auto& options) { return cli::run(options); }, *command);
  std::fprintf(stderr, "whittle: %s\nTry: whittle --help\n", command.error().c_str());
  return cli::invalid_usage;
} catch (const std::bad_alloc&) {
  std::fputs("whittle: out of memory\n", stderr);
  return cli::environment_failure;
} catch (const std::exception& failure) {
  std::fprintf(stderr, "whittle: %s\n", failure.what());
  return cli::environment_failure;
}
