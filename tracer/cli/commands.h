#pragma once
/// The things `whittle` does. Each returns the process's exit code.

#include "tracer/cli/command_options.h"
#include "tracer/cli/diff_options.h"
#include "tracer/cli/measure_options.h"

namespace cli {

/// Scripts rely on these; `whittle --help` tells them.
/// `diff` follows the command of that name: 1 is a difference, 2 is trouble with the images.
enum ExitCode : int {
  done = 0,
  bad_scene = 1,
  too_different = 1,
  bad_usage = 2,
  incomparable = 2,
  bad_environment = 3,
  interrupted = 130
};

/// Scene file to image files; figures and complaints go to standard error.
ExitCode render(const Options& options);

/// All issues, or what a valid scene needs, to standard output.
ExitCode check(const Options& options);

/// How far two images are apart, to standard output.
ExitCode diff(const DiffOptions& options);

/// What accuracy costs in a scene: files beside each other, a table to standard output.
ExitCode measure(const MeasureOptions& options);

}  // namespace cli
