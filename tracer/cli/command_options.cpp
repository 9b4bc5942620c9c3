#include "tracer/cli/command_options.h"

#include <charconv>
#include <optional>
#include <string_view>

#include "tracer/encode.h"

namespace cli {
namespace {

using namespace std::string_literals;
using Failure = std::optional<std::string>;

constexpr const char* endings = ".png, .16.png, .exr, .jpg, .hdr, .webp or .tiff";
constexpr std::uint32_t max_threads = 1024;  // more is a typing mistake

std::optional<tracer::Format> format_of(std::string_view path) {
  std::optional<tracer::Format> best;
  for (const tracer::Format format : tracer::all_formats) {
    const std::string_view extension = tracer::extension(format);
    if (!path.ends_with("." + std::string(extension))) continue;
    if (!best || extension.size() > tracer::extension(*best).size()) best = format;  // .16.png is no .png
  }
  return best;
}

Failure take_output(std::string_view path, Options& options) {
  const auto format = format_of(path);
  if (!format) return "-o "s.append(path) + ": the name must end in "s + endings;
  for (const Output& other : options.outputs) {
    if (other.path == path) return "-o "s.append(path) + " is given twice";
  }
  options.outputs.push_back({std::string(path), *format});
  return std::nullopt;
}

Failure take_threads(std::string_view text, Options& options) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), options.threads);
  const bool is_number = error == std::errc{} && end == text.data() + text.size();
  if (is_number && options.threads >= 1 && options.threads <= max_threads) return std::nullopt;
  return "--threads must be a whole number from 1 to "s + std::to_string(max_threads) + ", got \"" + std::string(text) +
         "\"";
}

Failure take_uploads_directory(std::span<const char* const>& rest, Options& options) {
  if (rest.empty() || *rest.front() == '\0') return "--assets needs a directory"s;
  options.uploads_directory = rest.front();
  rest = rest.subspan(1);
  return std::nullopt;
}

Failure take_render(std::string_view argument, std::span<const char* const>& rest, Options& options) {
  if (argument == "--quiet") {
    options.quiet = true;
    return std::nullopt;
  }
  if (argument == "--assets") return take_uploads_directory(rest, options);
  const bool is_output = argument == "-o";
  if (!is_output && argument != "--threads") return "render does not know "s.append(argument);
  if (rest.empty()) return std::string(argument) + " needs a value";
  const std::string_view value = rest.front();
  rest = rest.subspan(1);
  return is_output ? take_output(value, options) : take_threads(value, options);
}

Failure take_check(std::string_view argument, std::span<const char* const>& rest, Options& options) {
  if (argument == "--assets") return take_uploads_directory(rest, options);
  if (argument != "--json") return "check does not know "s.append(argument);
  options.json = true;
  return std::nullopt;
}

Failure take_scene(std::string_view argument, Options& options) {
  if (!options.scene_path.empty()) return "one scene at a time: "s.append(argument) + " is one too many";
  if (argument.empty()) return "the scene's name is empty";
  options.scene_path = argument;
  return std::nullopt;
}

Failure take_all(std::span<const char* const> rest, Options& options) {
  while (!rest.empty()) {
    const std::string_view argument = rest.front();
    rest = rest.subspan(1);
    Failure failure;
    if (argument == "-" || !argument.starts_with('-')) {
      failure = take_scene(argument, options);
    } else if (options.command == Options::Command::render) {
      failure = take_render(argument, rest, options);
    } else {
      failure = take_check(argument, rest, options);
    }
    if (failure) return failure;
  }
  if (options.scene_path.empty()) return "which scene? Give its file, or - for standard input"s;
  if (options.command == Options::Command::render && options.outputs.empty()) {
    return "where to? Give at least one -o with a name that ends in "s + endings;
  }
  return std::nullopt;
}

bool wants_help(std::span<const char* const> arguments) {
  for (const std::string_view argument : arguments) {
    if (argument == "--help" || argument == "-h") return true;
  }
  return false;
}

}  // namespace

const char* const help_text =
    "Whittle renders scene documents by Whitted ray tracing.\n"
    "\n"
    "  whittle render SCENE -o FILE [-o FILE ...] [--assets DIRECTORY] [--threads N] [--quiet]\n"
    "      Traces SCENE and writes the image; each FILE ends in .png (8 bit, sRGB), .exr (linear, 32-bit\n"
    "      float), .16.png, .jpg, .hdr, .webp or .tiff (16 bit).\n"
    "      Files appear complete or not at all. Figures go to standard error.\n"
    "      --assets DIRECTORY   where the files are that SCENE names by their sha256\n"
    "      --threads N   use N threads (default: one per processor); the image is the same for any number\n"
    "      --quiet       no progress bar, no figures\n"
    "\n"
    "  whittle check SCENE [--assets DIRECTORY] [--json]\n"
    "      Says everything that is wrong with SCENE, a line each: where, code, sentence; or what a valid one needs.\n"
    "      --json        the same as one JSON document\n"
    "\n"
    "  whittle diff A B [--tolerance LEVELS] [--worst N] [--heat FILE.png] [--heat-white LEVELS] [--json]\n"
    "      Says how far two images are apart on a screen, in levels (1/255 of the range from black to white): root\n"
    "      mean square, bias, PSNR, SSIM, the pixels that differ most. Reads PNG, JPEG, TIFF and WebP, taken for "
    "sRGB,\n"
    "      and OpenEXR and Radiance HDR, which are linear and get encoded as sRGB; alpha is not compared.\n"
    "      --tolerance LEVELS    exit code 1 when the root mean square is above this\n"
    "      --worst N             how many pixels to list (default 5)\n"
    "      --heat FILE.png       writes each pixel's difference as a colour, from black by blue, green and red to "
    "white\n"
    "      --heat-white LEVELS   what is white there (default: by the root mean square; it is told)\n"
    "      --json                the same as one JSON document\n"
    "\n"
    "  whittle measure SCENE [-o NAME] [--size WxH | --scale S] [--knobs K,K...] [--reference-samples N]\n"
    "                  [--assets DIRECTORY] [--threads N] [--quiet]\n"
    "      Renders SCENE at many settings, compares each image with a reference, and says what accuracy costs here:\n"
    "      NAME.csv, NAME.json, NAME.svg and NAME.png (seconds against error, what each render claimed beside it),\n"
    "      and a table with advice on standard output. Interrupted, the same command goes on from NAME.json and\n"
    "      NAME.reference.\n"
    "      -o NAME       default: SCENE's name with .measure for .json, in the working directory\n"
    "      --size WxH    in place of the document's size;  --scale S   in (0, 1]: a part of it\n"
    "      --knobs K,K   of target_error, samples, max_depth, cutoff, approximate, document (default: all)\n"
    "      --reference-samples N   at most so many in each pixel of the reference (default 512)\n"
    "      --assets DIRECTORY, --threads N, --quiet    as above; the time depends on the threads\n"
    "\n"
    "  whittle --version    whittle --help\n"
    "\n"
    "SCENE, A and B are files, or - for standard input.\n"
    "Exit codes: 0 done, 1 the scene is bad or the images differ by more than --tolerance, 2 the command line is "
    "bad\n"
    "or the images cannot be compared, 3 the environment failed (a file cannot be read or written, memory ran out),\n"
    "130 interrupted.\n";

tracer::Result<Options, std::string> parse_options(std::span<const char* const> arguments) {
  if (arguments.empty()) return "what to do? render, check, diff or measure"s;
  const std::string_view command = arguments.front();
  Options options;
  if (wants_help(arguments)) return options;
  if (command == "--version") {
    options.command = Options::Command::version;
    return options;
  }
  if (command == "diff") {
    auto diff = parse_diff_options(arguments.subspan(1));
    if (!diff) return std::move(diff.error());
    options.command = Options::Command::diff;
    options.diff = *std::move(diff);
    return options;
  }
  if (command == "measure") {
    auto measure = parse_measure_options(arguments.subspan(1));
    if (!measure) return std::move(measure.error());
    options.command = Options::Command::measure;
    options.measure = *std::move(measure);
    return options;
  }
  if (command != "render" && command != "check")
    return "\""s.append(command) + "\" is not a command: render, check, diff or measure";
  options.command = command == "render" ? Options::Command::render : Options::Command::check;
  if (auto failure = take_all(arguments.subspan(1), options)) return *std::move(failure);
  return options;
}

}  // namespace cli
