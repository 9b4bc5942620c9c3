#include "api/cli/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <iterator>
#include <string_view>

#include "tracer/encode.h"
#include "tracer/limits.h"
#include "tracer/version.h"

namespace cli {
namespace {

std::string extensions() { return tracer::alternatives(tracer::format_rows, &tracer::FormatRow::extension, "."); }

constexpr std::uint32_t threads_max = 1024;
constexpr std::size_t worst_max = 100'000;  // lines of output
constexpr std::uint32_t reference_samples_max = 10'000'000;

constexpr const char* exit_codes =
    "SCENE, A and B are files, or - for standard input.\n"
    "Exit codes: 0 success; 1 the scene is invalid, or the images differ by more than --tolerance; 2 the command line\n"
    "is invalid, or the images cannot be compared; 3 a file cannot be read or written, or memory ran out;\n"
    "130 interrupted.";

[[noreturn]] void reject(const std::string& option, const std::string& rule) {
  throw CLI::ValidationError(option, rule);
}

template <class Number>
bool parse_number(std::string_view text, Number& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc{} && end == text.data() + text.size();
}

std::string got(std::string_view text) { return ", got \"" + std::string(text) + "\""; }

/// Not CLI::Range: it accepts NaN, and reads "010" as octal.
template <class Into>
void add_integer(CLI::App& command, const std::string& option, Into& into, Into least, Into most,
                 const std::string& description) {
  const auto parse = [=, &into](const std::string& text) {
    if (!parse_number(text, into) || into < least || into > most)
      reject(option, "must be an integer from " + std::to_string(least) + " to " + std::to_string(most) + got(text));
  };
  command.add_option_function<std::string>(option, parse, description)->type_name("N");
}

template <class Allowed>
void add_real(CLI::App& command, const std::string& option, std::optional<double>& into, Allowed allowed,
              const std::string& rule, const std::string& type, const std::string& description) {
  const auto parse = [=, &into](const std::string& text) {
    double& value = into.emplace();
    if (!parse_number(text, value) || !allowed(value)) reject(option, "must be a number " + rule + got(text));
  };
  command.add_option_function<std::string>(option, parse, description)->type_name(type);
}

/// A required positional argument.
void add_path(CLI::App& command, const std::string& name, std::string& into, const std::string& description) {
  command.add_option(name, into, description)->required()->type_name("")->check([](const std::string& path) {
    return std::string(path.empty() ? "the file name is empty" : "");
  });
}

void add_scene(CLI::App& command, SceneSource& scene) {
  add_path(command, "SCENE", scene.path, "Scene document or model (.glb, .gltf, .obj, .ply, .stl)");
  add_real(
      command, "--time", scene.time, [](double value) { return std::abs(value) < HUGE_VAL; }, "that is finite",
      "SECONDS", "Time of a model's animation");
  command.add_option("--assets", scene.assets_directory, "Directory of the files that SCENE names by SHA-256")
      ->type_name("DIRECTORY")
      ->check([](const std::string& path) { return std::string(path.empty() ? "the directory name is empty" : ""); });
}

void add_threads(CLI::App& command, std::uint32_t& threads) {
  add_integer(command, "--threads", threads, 1u, threads_max,
              "Number of threads (default: one per processor); the image does not depend on it");
}

/// The longest extension decides: .16.png before .png.
std::optional<tracer::Format> format_of(std::string_view path) {
  std::optional<tracer::Format> best;
  for (const tracer::Format format : tracer::all_formats) {
    const std::string_view extension = tracer::row(format).extension;
    if (!path.ends_with("." + std::string(extension))) continue;
    if (!best || extension.size() > tracer::row(*best).extension.size()) best = format;
  }
  return best;
}

std::vector<RenderOptions::Output> outputs_of(const std::vector<std::string>& paths) {
  std::vector<RenderOptions::Output> outputs;
  for (const std::string& path : paths) {
    const auto format = format_of(path);
    if (!format) reject("-o", path + ": the name must end in " + extensions());
    if (std::ranges::count(paths, path) > 1) reject("-o", path + " is given twice");
    outputs.push_back({path, *format});
  }
  return outputs;
}

CLI::App* add_render(CLI::App& app, RenderOptions& options) {
  CLI::App* command = app.add_subcommand("render", "Render a scene to image files");
  add_scene(*command, options.scene);
  command
      ->add_option_function<std::vector<std::string>>(
          "-o", [&](const std::vector<std::string>& paths) { options.outputs = outputs_of(paths); },
          "Image file, may be repeated; its extension is " + extensions())
      ->required()
      ->allow_extra_args(false)
      ->type_name("FILE");
  command->add_option("--report", options.report_path, "Write the report of the render as JSON (- is standard output)")
      ->type_name("FILE");
  add_threads(*command, options.threads);
  command->add_flag("--require-target", options.require_target, "Exit code 1 if the image misses the target error");
  command->add_flag("--quiet", options.quiet, "No progress bar, no summary on standard error");
  return command;
}

CLI::App* add_import(CLI::App& app, ImportOptions& options) {
  CLI::App* command = app.add_subcommand(
      "import", "Write the scene document of a model (.glb, .gltf, .obj, .ply, .stl), and list what it does not have");
  add_scene(*command, options.model);
  command->add_option("-o", options.output, "File of the document (- is standard output)")
      ->required()
      ->type_name("FILE");
  return command;
}

CLI::App* add_check(CLI::App& app, CheckOptions& options) {
  CLI::App* command = app.add_subcommand(
      "check", "Validate a scene: one line per issue (pointer, code, rule), or what the scene requires");
  add_scene(*command, options.scene);
  command->add_flag("--json", options.json, "Print one JSON document instead");
  return command;
}

CLI::App* add_diff(CLI::App& app, DiffOptions& options) {
  CLI::App* command = app.add_subcommand(
      "diff",
      "Compare two images as displayed, in levels (1/255 of the range from black to white).\n"
      "Reads OpenEXR and Radiance HDR as linear, and the other formats that render writes as sRGB. Alpha is ignored.");
  add_path(*command, "A", options.images[0], "Reference image");
  add_path(*command, "B", options.images[1], "Image to compare");
  add_real(
      *command, "--tolerance", options.tolerance, [](double value) { return value >= 0 && value < HUGE_VAL; }, ">= 0",
      "LEVELS", "Exit with 1 when the root mean square error is larger");
  add_integer(*command, "--worst", options.worst, std::size_t{0}, worst_max, "Number of pixels to list (default 5)");
  CLI::Option* heat =
      command->add_option("--heat", options.heat_path, "Write the difference of each pixel as a color, black to white")
          ->type_name("FILE.png")
          ->check([](const std::string& path) {
            return path.ends_with(".png") ? std::string() : path + ": the name must end in .png";
          });
  add_real(
      *command, "--heat-white", options.heat_white, [](double value) { return value > 0 && value < HUGE_VAL; }, "> 0",
      "LEVELS", "Difference that is white in the heat map (default: derived from the error)");
  command->get_option("--heat-white")->needs(heat);
  command->add_flag("--json", options.json, "Print one JSON document instead");
  command->final_callback([&] {
    const auto& [a, b] = options.images;
    if (a == "-" && b == "-") reject("diff", "only one of the images can be standard input");
    if (options.heat_path == a || options.heat_path == b) reject("--heat", "would replace an image that is compared");
  });
  return command;
}

void parse_size(const std::string& text, MeasureOptions& options) {
  const std::size_t cross = text.find('x');
  const std::uint32_t most = tracer::Limits().image_side;
  auto& [width, height] = options.size.emplace();
  const bool parsed = cross != std::string::npos && parse_number(std::string_view(text).substr(0, cross), width) &&
                      parse_number(std::string_view(text).substr(cross + 1), height);
  if (!parsed || width < 1 || width > most || height < 1 || height > most)
    reject("--size", "must be WIDTHxHEIGHT, integers from 1 to " + std::to_string(most) + got(text));
}

/// "whitted.measure" in the working directory for scenes/whitted.json.
std::string default_name(std::string_view scene_path) {
  if (scene_path == "-") return "scene.measure";
  std::string_view stem = scene_path.substr(scene_path.rfind('/') + 1);  // npos + 1 is 0
  if (stem.ends_with(".json")) stem.remove_suffix(5);
  return std::string(stem) + ".measure";
}

/// The elements of lists separated by commas. Not CLI::Option::delimiter: it accepts a comma at the end.
std::vector<std::string> parameters_of(const std::vector<std::string>& lists) {
  const CLI::IsMember known(std::vector<std::string>(std::begin(tracer::parameters), std::end(tracer::parameters)));
  std::vector<std::string> names;
  for (const std::string& list : lists) {
    for (std::size_t begin = 0, end = 0; begin <= list.size(); begin = end + 1) {
      end = std::min(list.find(',', begin), list.size());
      std::string& name = names.emplace_back(list.substr(begin, end - begin));
      if (const std::string error = known(name); !error.empty()) reject("--parameters", error);
    }
  }
  return names;
}

CLI::App* add_measure(CLI::App& app, MeasureOptions& options) {
  CLI::App* command = app.add_subcommand(
      "measure",
      "Render a scene at many settings and report time against true and estimated error.\n"
      "Writes NAME.csv, .json, .svg and .png, and prints a table. Rerun an interrupted command to resume it.");
  add_scene(*command, options.scene);
  command->add_option("-o", options.name, "Name of the files (default: SCENE with .measure for .json)")
      ->type_name("NAME")
      ->check([](const std::string& name) {
        return name.empty() || name.ends_with('/') ? name + ": must be a name for the files" : std::string();
      });
  CLI::Option* size = command->add_option_function<std::string>(
      "--size", [&](const std::string& text) { parse_size(text, options); }, "Pixels, replaces the document's size");
  size->type_name("WIDTHxHEIGHT");
  add_real(
      *command, "--scale", options.scale, [](double value) { return value > 0 && value <= 1; }, "> 0 and <= 1",
      "FACTOR", "Factor of the document's size");
  size->excludes(command->get_option("--scale"));
  command
      ->add_option_function<std::vector<std::string>>(
          "--parameters", [&](const std::vector<std::string>& lists) { options.parameters = parameters_of(lists); },
          "Settings to vary (default: all)")
      ->type_name("P,P...")
      ->allow_extra_args(false);
  add_integer(*command, "--reference-samples", options.reference_samples, tracer::reference_samples_min,
              reference_samples_max, "Maximum samples per pixel of the reference (default 512)");
  add_threads(*command, options.threads);
  command->add_flag("--quiet", options.quiet, "No progress bar");
  command->final_callback([&] {
    if (options.name.empty()) options.name = default_name(options.scene.path);
  });
  return command;
}

}  // namespace

tracer::Result<Command, std::string> parse_arguments(std::vector<std::string> arguments) {
  CLI::App app("Whittle renders scene documents by ray tracing.", "whittle");
  app.set_version_flag("--version", "whittle " + std::string(tracer::build()), "Print the version");
  app.footer(exit_codes);
  app.require_subcommand(0, 1);  // a file may have the name of a command
  RenderOptions render;
  ImportOptions import;
  CheckOptions check;
  DiffOptions diff;
  MeasureOptions measure;
  const CLI::App* commands[] = {add_render(app, render), add_import(app, import), add_check(app, check),
                                add_diff(app, diff), add_measure(app, measure)};
  std::ranges::reverse(arguments);  // as CLI11 takes them
  try {
    app.parse(std::move(arguments));
  } catch (const CLI::CallForHelp&) {
    return Command(PrintText{app.help()});
  } catch (const CLI::CallForVersion& version) {
    return Command(PrintText{version.what() + std::string("\n")});
  } catch (const CLI::ParseError& error) {
    return std::string(error.what());
  }
  if (commands[0]->parsed()) return Command(std::move(render));
  if (commands[1]->parsed()) return Command(std::move(import));
  if (commands[2]->parsed()) return Command(std::move(check));
  if (commands[3]->parsed()) return Command(std::move(diff));
  if (commands[4]->parsed()) return Command(std::move(measure));
  return std::string("a command is required: render, import, check, diff or measure");
}

}  // namespace cli
