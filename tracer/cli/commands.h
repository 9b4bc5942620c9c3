#pragma once
/// The two things `whittle` does. Each returns the process's exit code.

#include "tracer/cli/options.h"

namespace cli {

/// Scripts rely on these; `whittle --help` tells them.
enum ExitCode : int { done = 0, bad_scene = 1, bad_usage = 2, bad_environment = 3, interrupted = 130 };

/// Scene file to picture files; figures and complaints go to standard error.
ExitCode render(const Options& options);

/// All issues, or what a valid scene needs, to standard output.
ExitCode check(const Options& options);

}  // namespace cli
