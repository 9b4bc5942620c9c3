#pragma once
/// What the user of the command line asked for: arguments in, one plain value out.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "tracer/cli/diff_options.h"
#include "tracer/cli/measure_options.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace cli {

/// One file to write; the format is what its extension says.
struct Output {
  std::string path;
  tracer::Format format = tracer::Format::png;
};

struct Options {
  enum class Command { render, check, diff, measure, help, version };
  Command command = Command::help;
  std::string scene_path;         ///< "-" is standard input
  std::string uploads_directory;  ///< render, check: of files named by their sha256; empty: none
  std::vector<Output> outputs;    ///< render: at least one
  std::uint32_t threads = 0;      ///< render: 0 is one per processor
  bool quiet = false;             ///< render: no progress, no figures
  bool json = false;              ///< check: the verdict as one JSON document
  DiffOptions diff;               ///< diff: all of its own
  MeasureOptions measure;         ///< measure: likewise
};

/// `arguments` are those after the program's name. Fails with a sentence that says what is wrong with them.
tracer::Result<Options, std::string> parse_options(std::span<const char* const> arguments);

/// The text of `whittle --help`.
extern const char* const help_text;

}  // namespace cli
