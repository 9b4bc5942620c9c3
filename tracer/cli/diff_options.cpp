#include "tracer/cli/diff_options.h"

#include <charconv>
#include <cmath>
#include <string_view>

namespace cli {
namespace {

using namespace std::string_literals;
using Failure = std::optional<std::string>;

constexpr std::size_t max_worst = 100'000;  // lines; more is a mistake

template <class Number>
bool read_number(std::string_view text, Number& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc{} && end == text.data() + text.size();
}

Failure take_levels(std::string_view option, std::string_view text, bool zero_is_fine, std::optional<double>& into) {
  double levels = 0;
  if (read_number(text, levels) && std::isfinite(levels) && (levels > 0 || (zero_is_fine && levels == 0))) {
    into = levels;
    return std::nullopt;
  }
  return std::string(option) + " must be a number of levels " + (zero_is_fine ? ">= 0" : "> 0") + ", got \"" +
         std::string(text) + "\"";
}

Failure take_worst(std::string_view text, std::size_t& worst) {
  if (read_number(text, worst) && worst <= max_worst) return std::nullopt;
  return "--worst must be a whole number from 0 to " + std::to_string(max_worst) + ", got \"" + std::string(text) +
         "\"";
}

Failure take_heat(std::string_view text, DiffOptions& options) {
  if (!text.ends_with(".png")) return "--heat "s.append(text) + ": the name must end in .png";
  options.heat_path = text;
  return std::nullopt;
}

Failure take_value(std::string_view option, std::string_view value, DiffOptions& options) {
  if (option == "--heat") return take_heat(value, options);
  if (option == "--heat-white") return take_levels(option, value, false, options.heat_white);
  if (option == "--tolerance") return take_levels(option, value, true, options.tolerance);
  return take_worst(value, options.worst);
}

Failure take_option(std::string_view option, std::span<const char* const>& rest, DiffOptions& options) {
  if (option == "--json") {
    options.json = true;
    return std::nullopt;
  }
  if (option != "--heat" && option != "--heat-white" && option != "--tolerance" && option != "--worst")
    return "diff does not know "s.append(option);
  if (rest.empty()) return std::string(option) + " needs a value";
  const std::string_view value = rest.front();
  rest = rest.subspan(1);
  return take_value(option, value, options);
}

Failure take_image(std::string_view path, DiffOptions& options) {
  if (path.empty()) return "an image's name is empty"s;
  for (std::string& image : options.images) {
    if (image == "-" && path == "-") return "only one of the images can be standard input"s;
    if (!image.empty()) continue;
    image = path;
    return std::nullopt;
  }
  return "two images at a time: "s.append(path) + " is one too many";
}

}  // namespace

tracer::Result<DiffOptions, std::string> parse_diff_options(std::span<const char* const> rest) {
  DiffOptions options;
  while (!rest.empty()) {
    const std::string_view argument = rest.front();
    rest = rest.subspan(1);
    const bool is_option = argument.starts_with('-') && argument != "-";
    Failure failure = is_option ? take_option(argument, rest, options) : take_image(argument, options);
    if (failure) return *std::move(failure);
  }
  if (options.images[1].empty()) return "which images? Give two files"s;
  if (options.heat_white && !options.heat_path) return "--heat-white is for the heat map: give --heat too"s;
  if (options.heat_path == options.images[0] || options.heat_path == options.images[1])
    return "--heat would replace an image that is compared"s;
  return options;
}

}  // namespace cli
