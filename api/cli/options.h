#pragma once
/// Command line of `whittle`: arguments in, one plain value out, and the command that runs it.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "tracer/measure.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace cli {

/// Input of every command that reads a scene.
struct SceneSource {
  std::string path;              ///< "-" is standard input
  std::string assets_directory;  ///< files named by their SHA-256; empty: none
  std::optional<double> time;    ///< seconds of a model's animation
};

struct ImportOptions {
  SceneSource model;
  std::string output;  ///< path of the document, "-" for standard output
};

struct RenderOptions {
  struct Output {
    std::string path;
    tracer::Format format = tracer::Format::png;
  };
  SceneSource scene;
  std::vector<Output> outputs;  ///< at least one
  std::string report_path;      ///< JSON file, "-" for standard output; empty: none
  std::uint32_t threads = 0;    ///< 0 is one per processor
  bool quiet = false;           ///< no progress bar, no summary
  bool require_target = false;  ///< an image that misses the document's target error is a failure
};

struct CheckOptions {
  SceneSource scene;
  bool json = false;
};

struct DiffOptions {
  std::array<std::string, 2> images;     ///< the reference first; at most one is "-", standard input
  std::optional<std::string> heat_path;  ///< heat map, a PNG
  std::optional<double> heat_white;      ///< 8-bit code values; unset: tracer::heat_scale
  std::optional<double> tolerance;       ///< 8-bit code values of root mean square error
  std::size_t worst = 5;                 ///< number of pixels to list
  bool json = false;
};

struct MeasureOptions {
  SceneSource scene;
  std::string name;                                             ///< path of the files, without extension
  std::optional<std::pair<std::uint32_t, std::uint32_t>> size;  ///< pixels; replaces the document's
  std::optional<double> scale;                                  ///< factor of the document's size, in (0, 1]
  std::vector<std::string> parameters;                          ///< empty: all
  std::uint32_t reference_samples = tracer::MeasureSettings().reference_samples;
  std::uint32_t threads = 0;  ///< 0 is one per processor
  bool quiet = false;         ///< no progress bar
};

/// Text to print on standard output: the help or the version.
struct PrintText {
  std::string text;
};

using Command = std::variant<PrintText, RenderOptions, ImportOptions, CheckOptions, DiffOptions, MeasureOptions>;

/// `arguments` without the program's name. Fails with one line that names the option and the rule.
tracer::Result<Command, std::string> parse_arguments(std::vector<std::string> arguments);

/// Scripts rely on these; `whittle --help` lists them. Like diff(1), `whittle diff` uses 1 for a difference and 2 for
/// trouble.
enum ExitCode : int {
  success = 0,
  invalid_scene = 1,
  images_differ = 1,
  target_missed = 1,
  invalid_usage = 2,
  incomparable_images = 2,
  environment_failure = 3,
  interrupted = 130
};

/// Each command returns the process's exit code.
ExitCode run(const PrintText& print);
ExitCode run(const RenderOptions& options);   ///< writes image files; summary and errors on standard error
ExitCode run(const ImportOptions& options);   ///< writes the document of a model
ExitCode run(const CheckOptions& options);    ///< prints all issues or the requirements of a valid scene
ExitCode run(const DiffOptions& options);     ///< prints the metrics of two images
ExitCode run(const MeasureOptions& options);  ///< writes the files of a measurement and prints a table

}  // namespace cli
