#include "tracer/cli/measure_options.h"

#include <algorithm>
#include <charconv>
#include <string_view>

#include "tracer/limits.h"

namespace cli {
namespace {

using namespace std::string_literals;
using Failure = std::optional<std::string>;

constexpr std::uint32_t max_threads = 1024;                  // more is a typing mistake
constexpr std::uint32_t max_reference_samples = 10'000'000;  // likewise

template <class Number>
bool read_number(std::string_view text, Number& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc{} && end == text.data() + text.size();
}

std::string got(std::string_view text) { return ", got \"" + std::string(text) + "\""; }

Failure take_whole(std::string_view option, std::string_view text, std::uint32_t least, std::uint32_t most,
                   std::uint32_t& into) {
  if (read_number(text, into) && into >= least && into <= most) return std::nullopt;
  return std::string(option) + " must be a whole number from " + std::to_string(least) + " to " + std::to_string(most) +
         got(text);
}

Failure take_size(std::string_view text, MeasureOptions& options) {
  const std::size_t cross = text.find('x');
  const std::uint32_t most = tracer::Limits().image_side;
  auto& [width, height] = options.size.emplace();
  const bool read = cross != std::string_view::npos && read_number(text.substr(0, cross), width) &&
                    read_number(text.substr(cross + 1), height);
  if (read && width >= 1 && width <= most && height >= 1 && height <= most) return std::nullopt;
  return "--size must be WIDTHxHEIGHT, whole numbers from 1 to " + std::to_string(most) + got(text);
}

Failure take_scale(std::string_view text, MeasureOptions& options) {
  double& scale = options.scale.emplace();
  if (read_number(text, scale) && scale > 0 && scale <= 1) return std::nullopt;
  return "--scale must be a number above 0, at most 1" + got(text);
}

Failure take_knobs(std::string_view text, MeasureOptions& options) {
  for (std::size_t first = 0; first <= text.size();) {
    const std::size_t end = std::min(text.find(',', first), text.size());
    const std::string_view knob = text.substr(first, end - first);
    if (std::find(std::begin(tracer::knobs), std::end(tracer::knobs), knob) == std::end(tracer::knobs)) {
      std::string sentence = "--knobs: \"" + std::string(knob) + "\" is none of";
      for (const std::string_view known : tracer::knobs) sentence.append(" ").append(known);
      return sentence;
    }
    options.knobs.emplace_back(knob);
    first = end + 1;
  }
  return std::nullopt;
}

Failure take_name(std::string_view text, MeasureOptions& options) {
  options.name = text;
  if (text.empty() || text.ends_with('/')) return "-o "s.append(text) + ": give a name for the files"s;
  return std::nullopt;
}

Failure take_value(std::string_view option, std::string_view value, MeasureOptions& options) {
  if (option == "-o") return take_name(value, options);
  if (option == "--assets") {
    options.uploads_directory = value;
    return std::nullopt;
  }
  if (option == "--size") return take_size(value, options);
  if (option == "--scale") return take_scale(value, options);
  if (option == "--knobs") return take_knobs(value, options);
  if (option == "--threads") return take_whole(option, value, 1, max_threads, options.threads);
  return take_whole(option, value, tracer::reference_samples_min, max_reference_samples, options.reference_samples);
}

Failure take_option(std::string_view option, std::span<const char* const>& rest, MeasureOptions& options) {
  if (option == "--quiet") {
    options.quiet = true;
    return std::nullopt;
  }
  constexpr std::string_view with_value[] = {"-o",        "--assets",           "--size", "--scale", "--knobs",
                                             "--threads", "--reference-samples"};
  if (std::find(std::begin(with_value), std::end(with_value), option) == std::end(with_value))
    return "measure does not know "s.append(option);
  if (rest.empty()) return std::string(option) + " needs a value";
  const std::string_view value = rest.front();
  rest = rest.subspan(1);
  return take_value(option, value, options);
}

Failure take_scene(std::string_view path, MeasureOptions& options) {
  if (!options.scene_path.empty()) return "one scene at a time: "s.append(path) + " is one too many";
  if (path.empty()) return "the scene's name is empty";
  options.scene_path = path;
  return std::nullopt;
}

/// "whitted.measure", in the working directory, for scenes/whitted.json.
std::string usual_name(std::string_view scene_path) {
  if (scene_path == "-") return "scene.measure";
  std::string_view stem = scene_path.substr(scene_path.rfind('/') + 1);  // npos + 1 is 0
  if (stem.ends_with(".json")) stem.remove_suffix(5);
  return std::string(stem) + ".measure";
}

}  // namespace

tracer::Result<MeasureOptions, std::string> parse_measure_options(std::span<const char* const> rest) {
  MeasureOptions options;
  while (!rest.empty()) {
    const std::string_view argument = rest.front();
    rest = rest.subspan(1);
    const bool is_option = argument.starts_with('-') && argument != "-";
    Failure failure = is_option ? take_option(argument, rest, options) : take_scene(argument, options);
    if (failure) return *std::move(failure);
  }
  if (options.scene_path.empty()) return "which scene? Give its file, or - for standard input"s;
  if (options.size && options.scale) return "--size and --scale: one of them is enough"s;
  if (options.name.empty()) options.name = usual_name(options.scene_path);
  return options;
}

}  // namespace cli
