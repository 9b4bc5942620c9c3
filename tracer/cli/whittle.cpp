// whittle: the command line of the tracer. `whittle --help` is its manual.
#include <cstdio>
#include <exception>
#include <new>
#include <span>
#include <string>

#include "tracer/cli/command_options.h"
#include "tracer/cli/commands.h"
#include "tracer/version.h"

namespace {

/// Answers asked for on standard output are worth an exit code when they do not arrive (a full disk, a closed pipe).
cli::ExitCode print(const std::string& text) {
  const bool printed = std::fputs(text.c_str(), stdout) >= 0 && std::fflush(stdout) == 0;
  return printed ? cli::done : cli::bad_environment;
}

cli::ExitCode run(std::span<const char* const> arguments) {
  const auto options = cli::parse_options(arguments);
  if (!options) {
    std::fprintf(stderr, "whittle: %s\nTry: whittle --help\n", options.error().c_str());
    return cli::bad_usage;
  }
  switch (options->command) {
    case cli::Options::Command::render:
      return cli::render(*options);
    case cli::Options::Command::check:
      return cli::check(*options);
    case cli::Options::Command::diff:
      return cli::diff(options->diff);
    case cli::Options::Command::measure:
      return cli::measure(options->measure);
    case cli::Options::Command::version:
      return print("whittle " + std::string(tracer::build()) + "\n");
    case cli::Options::Command::help:
      break;
  }
  return print(cli::help_text);
}

}  // namespace

int main(int count, char** arguments) try {
  return run(std::span<const char* const>(arguments, static_cast<std::size_t>(count)).subspan(count > 0 ? 1 : 0));
} catch (const std::bad_alloc&) {
  std::fputs("whittle: out of memory\n", stderr);
  return cli::bad_environment;
} catch (const std::exception& failure) {
  std::fprintf(stderr, "whittle: %s\n", failure.what());
  return cli::bad_environment;
}
