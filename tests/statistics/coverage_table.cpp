// Compares the estimated with the true error of adaptive images of many scenes at several targets. Prints a table; the
// exit code is 1 if a criterion does not hold.
#include <algorithm>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>

#include "tests/statistics/coverage_report.h"
#include "tracer/encode.h"

namespace {

using namespace statistics;

constexpr std::string_view usage =
    R"(coverage_table [options]: estimated against true error of adaptive images.
  --scenes a,b     only these; --list prints all names
  --targets 4,1    code values; default 4,2,1,0.5,0.25
  --seeds N        images of each target, default 3
  --fast           targets 4,1 and one seed, no injected bias
  --json FILE      every trial
  --references DIR where references are kept; default coverage-references beside the directory of this program
  --images DIR     also writes each reference as PNG there
  --threads N      default: all
)";

struct Options {
  std::vector<const Case*> scenes;
  std::vector<double> targets{4, 2, 1, 0.5, 0.25};
  std::uint64_t seeds = 3;
  bool bias = true;
  std::filesystem::path json, references, images;
  std::uint32_t threads = 0;
};

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, ',');) parts.push_back(part);
  return parts;
}

/// Throws std::invalid_argument.
Options parse(const std::vector<std::string>& arguments) {
  Options options;
  for (std::size_t i = 1; i < arguments.size(); ++i) {
    const std::string& name = arguments[i];
    const auto value = [&] {
      if (i + 1 == arguments.size()) throw std::invalid_argument(name + " needs a value");
      return arguments[++i];
    };
    if (name == "--scenes") {
      for (const std::string& scene : split(value())) {
        options.scenes.push_back(find(scene));
        if (options.scenes.back() == nullptr) throw std::invalid_argument("unknown scene " + scene);
      }
    } else if (name == "--targets") {
      options.targets.clear();
      for (const std::string& target : split(value())) options.targets.push_back(std::stod(target));
      std::sort(options.targets.rbegin(), options.targets.rend());
    } else if (name == "--seeds") {
      options.seeds = std::stoull(value());
    } else if (name == "--fast") {
      options.targets = {4, 1};
      options.seeds = 1;
      options.bias = false;
    } else if (name == "--json") {
      options.json = value();
    } else if (name == "--references") {
      options.references = value();
    } else if (name == "--images") {
      options.images = value();
    } else if (name == "--threads") {
      options.threads = static_cast<std::uint32_t>(std::stoul(value()));
    } else {
      throw std::invalid_argument(name + " is not an option");
    }
  }
  if (options.scenes.empty())
    for (const Case& scene : corpus()) options.scenes.push_back(&scene);
  if (options.references.empty())
    options.references = std::filesystem::absolute(arguments[0]).parent_path().parent_path() / "coverage-references";
  return options;
}

void write_image(const Case& scene, const ReferenceImage& reference, const std::filesystem::path& directory) {
  const tracer::PixelWindow window = scene.scene.image.window();
  const tracer::Image image{window.width(), window.height(), {reference.linear.begin(), reference.linear.end()}};
  const auto png = tracer::encode(image, tracer::Format::png, scene.scene.output);
  if (!png) throw std::runtime_error(png.error());
  std::filesystem::create_directories(directory);
  std::ofstream(directory / (scene.name + ".png"), std::ios::binary)
      .write(reinterpret_cast<const char*>(png->bytes.data()), static_cast<std::streamsize>(png->bytes.size()));
}

SceneTrials run_trials(const Case& scene, const Options& options) {
  const ReferenceSettings settings{.threads = options.threads};
  const GroundTruth ground_truth{compute_reference(scene, settings, options.references),
                                 classify_pixels(scene, options.threads)};
  if (!options.images.empty()) write_image(scene, ground_truth.reference, options.images);
  SceneTrials scene_trials{scene.name, {}, {}};
  std::uint64_t seed = 0;  // differs between images: their errors are independent
  for (const double target : options.targets)
    for (std::uint64_t i = 0; i < options.seeds; ++i) {
      tracer::Rendered rendered = render_to_target(scene, target, ++seed, options.threads);
      scene_trials.trials.push_back(evaluate(scene, ground_truth, rendered, target, seed));
      if (!options.bias || i > 0 || scene.scene.lights.empty()) continue;
      inject_bias(rendered.image, render_to_target(without_light(scene), target, seed, options.threads).image, seed);
      scene_trials.biased.push_back(evaluate(scene, ground_truth, rendered, target, seed));
    }
  return scene_trials;
}

int run(const std::vector<std::string>& arguments) {
  const Options options = parse(arguments);
  std::vector<SceneTrials> scenes;
  print_heading(std::cout);
  for (const Case* scene : options.scenes) {
    scenes.push_back(run_trials(*scene, options));
    print(std::cout, scenes.back());
  }
  const CoverageReport report = report_coverage(scenes);
  print(std::cout, report);
  if (!options.json.empty()) {
    std::ofstream json(options.json);
    write_json(json, scenes, report);
    if (!json.flush()) throw std::runtime_error("cannot write " + options.json.string());
  }
  return report.failures.empty() ? 0 : 1;
}

}  // namespace

int main(int count, char** values) {
  const std::vector<std::string> arguments(values, values + count);
  if (std::find(arguments.begin(), arguments.end(), "--help") != arguments.end()) {
    std::cout << usage;
    return 0;
  }
  if (std::find(arguments.begin(), arguments.end(), "--list") != arguments.end()) {
    for (const Case& scene : corpus()) std::cout << scene.name << ": " << scene.exercises << "\n";
    return 0;
  }
  try {
    return run(arguments);
  } catch (const std::exception& problem) {
    std::cerr << "coverage_table: " << problem.what() << "\n" << usage;
    return 2;
  }
}
