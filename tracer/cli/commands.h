#pragma once
/// The commands of `whittle`. Each returns the process's exit code.

#include "tracer/cli/options.h"

namespace cli {

/// Scripts rely on these; `whittle --help` lists them. Like diff(1), `whittle diff` uses 1 for a difference and 2 for
/// trouble.
enum ExitCode : int {
  success = 0,
  invalid_scene = 1,
  images_differ = 1,
  invalid_usage = 2,
  incomparable_images = 2,
  environment_failure = 3,
  interrupted = 130
};

ExitCode run(const PrintText& print);
ExitCode run(const RenderOptions& options);   ///< writes image files; summary and errors on standard error
ExitCode run(const CheckOptions& options);    ///< prints all issues or the requirements of a valid scene
ExitCode run(const DiffOptions& options);     ///< prints the metrics of two images
ExitCode run(const MeasureOptions& options);  ///< writes the files of a measurement and prints a table

}  // namespace cli
