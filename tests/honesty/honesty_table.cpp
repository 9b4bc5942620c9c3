// Whether the tracer keeps its promises about error: images of many scenes asked for with several targets, each held
// against a converged reference; one table, and exit code 1 where a criterion is broken.
#include <algorithm>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>

#include "tests/honesty/verdict.h"
#include "tracer/encode.h"

namespace {

using namespace honesty;

constexpr std::string_view usage =
    R"(honesty_table [options]: claimed against true error of adaptive images.
  --scenes a,b     only these; --list prints all names
  --targets 4,1    levels; default 4,2,1,0.5,0.25
  --seeds N        images of each target, default 3
  --fast           targets 4,1 and one seed, no seeded bias
  --json FILE      every trial
  --references DIR where references are kept; default honesty-references beside the directory of this program
  --images DIR   also writes each reference as PNG there
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
      if (i + 1 == arguments.size()) throw std::invalid_argument(name + " wants a value");
      return arguments[++i];
    };
    if (name == "--scenes") {
      for (const std::string& scene : split(value())) {
        options.scenes.push_back(find(scene));
        if (options.scenes.back() == nullptr) throw std::invalid_argument("no scene is called " + scene);
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
      throw std::invalid_argument(name + " is no option");
    }
  }
  if (options.scenes.empty())
    for (const Case& scene : corpus()) options.scenes.push_back(&scene);
  if (options.references.empty())
    options.references = std::filesystem::absolute(arguments[0]).parent_path().parent_path() / "honesty-references";
  return options;
}

void write_image(const Case& scene, const Reference& reference, const std::filesystem::path& directory) {
  const tracer::PixelWindow window = scene.scene.image.window();
  const tracer::Image image{window.width(), window.height(), {reference.linear.begin(), reference.linear.end()}};
  const auto bytes = tracer::encode(image, tracer::Format::png, scene.scene.output);
  if (!bytes) throw std::runtime_error(bytes.error());
  std::filesystem::create_directories(directory);
  std::ofstream(directory / (scene.name + ".png"), std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes->data()), static_cast<std::streamsize>(bytes->size()));
}

Outcome outcome_of(const Case& scene, const Options& options) {
  const ReferenceEffort effort{.threads = options.threads};
  const Standard standard{reference_of(scene, effort, options.references), strata_of(scene, options.threads)};
  if (!options.images.empty()) write_image(scene, standard.reference, options.images);
  Outcome outcome{scene.name, {}, {}};
  std::uint64_t seed = 0;  // another one for each image, so that chance strikes each by itself
  for (const double target : options.targets)
    for (std::uint64_t i = 0; i < options.seeds; ++i) {
      tracer::Rendered rendered = rendered_to(scene, target, ++seed, options.threads);
      outcome.trials.push_back(judged(scene, standard, rendered, target, seed));
      if (!options.bias || i > 0 || scene.scene.lights.empty()) continue;
      seed_bias(rendered.image, rendered_to(without_light(scene), target, seed, options.threads).image, seed);
      outcome.biased.push_back(judged(scene, standard, rendered, target, seed));
    }
  return outcome;
}

int run(const std::vector<std::string>& arguments) {
  const Options options = parse(arguments);
  std::vector<Outcome> outcomes;
  print_heading(std::cout);
  for (const Case* scene : options.scenes) {
    outcomes.push_back(outcome_of(*scene, options));
    print(std::cout, outcomes.back());
  }
  const Verdict verdict = verdict_on(outcomes);
  print(std::cout, verdict);
  if (!options.json.empty()) {
    std::ofstream json(options.json);
    write_json(json, outcomes, verdict);
    if (!json.flush()) throw std::runtime_error("cannot write " + options.json.string());
  }
  return verdict.broken.empty() ? 0 : 1;
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
    std::cerr << "honesty_table: " << problem.what() << "\n" << usage;
    return 2;
  }
}
