// What adaptive sampling buys, and whether time budgets are kept: each scene with several targets beside the same
// number of samples everywhere, at equal true error; and with several budgets, by how far they are overrun and whether
// what is claimed holds. Times are of building and tracing on one thread, taken in one process.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>

#include "tests/honesty/equal_error.h"

namespace {

using namespace honesty;

constexpr const char* usage =
    R"(budget_table REFERENCES [options]: what adaptive samples cost beside uniform ones, and time budgets.
REFERENCES is a directory to keep references in; "none": errors are not judged, and only budgets are looked at.
  --scale N        enlarges the images, of 48 x 36 pixels mostly, in each direction; default 1. Of larger images the
                   references are coarser: their own error is taken out of what is measured
  --scenes a,b     only these, by the names that honesty_table --list has
  --targets 4,1    levels; default 4,2,1,0.5,0.25; "none" for none
  --budgets 50,200 milliseconds; default 50,200,1000; "none" for none
  --repeats N      of every budget; default 1
  --threads N      of images with a budget; default 1, whose clock stands still while others have the processor
  --size W,H       pixels of every image, in place of a scale
)";

struct Options {
  std::string references;
  std::uint32_t scale = 1, repeats = 1, threads = 1, width = 0, height = 0;
  std::vector<std::string> scenes;
  std::vector<double> targets{4, 2, 1, 0.5, 0.25}, budgets{50, 200, 1000};
};

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, ',');) parts.push_back(part);
  return parts;
}

std::vector<double> numbers(const std::string& text) {
  std::vector<double> values;
  if (text == "none") return values;
  for (const std::string& part : split(text)) values.push_back(std::stod(part));
  return values;
}

/// Throws std::invalid_argument.
Options parse(const std::vector<std::string>& arguments) {
  if (arguments.empty()) throw std::invalid_argument("give a directory for references");
  Options options;
  options.references = arguments[0];
  for (std::size_t i = 1; i < arguments.size(); i += 2) {
    if (i + 1 == arguments.size()) throw std::invalid_argument(arguments[i] + " wants a value");
    const std::string &name = arguments[i], &value = arguments[i + 1];
    if (name == "--scale") {
      options.scale = static_cast<std::uint32_t>(std::stoul(value));
    } else if (name == "--scenes") {
      options.scenes = split(value);
    } else if (name == "--targets") {
      options.targets = numbers(value);
    } else if (name == "--budgets") {
      options.budgets = numbers(value);
    } else if (name == "--repeats") {
      options.repeats = static_cast<std::uint32_t>(std::stoul(value));
    } else if (name == "--threads") {
      options.threads = static_cast<std::uint32_t>(std::stoul(value));
    } else if (name == "--size") {
      const std::vector<double> size = numbers(value);
      if (size.size() != 2) throw std::invalid_argument("--size wants width and height");
      options.width = static_cast<std::uint32_t>(size[0]);
      options.height = static_cast<std::uint32_t>(size[1]);
    } else {
      throw std::invalid_argument(name + " is no option");
    }
  }
  return options;
}

/// Geometric means of what uniform samples cost, in units of what adaptive ones did.
class Gains {
 public:
  void add(const Purchase& uniform, const Purchase& adaptive) {
    log_seconds_ += std::log(uniform.seconds / adaptive.seconds);
    log_rays_ += std::log(uniform.rays / adaptive.rays);
    ++count_;
  }
  void print(const std::string& what) const {
    if (count_ == 0) return;
    std::printf("equal error, %-16s uniform takes %5.2f times as long and %5.2f times the rays (%.0f pairs)\n",
                (what + ":").c_str(), std::exp(log_seconds_ / count_), std::exp(log_rays_ / count_), count_);
  }

 private:
  double log_seconds_ = 0, log_rays_ = 0, count_ = 0;
};

class Table {
 public:
  void compare(const Case& scene, const Standard& standard, const std::string& kind,
               const std::vector<double>& wanted) {
    UniformCurve uniform(scene, standard);
    std::uint64_t seed = 0;
    for (const double target : wanted) {
      const Purchase point = bought(scene, &standard, adaptive_to(target, {}, ++seed));
      std::printf("%-20s target %5.2f  error %6.3f  claimed %6.3f  samples %7.2f + %6.2f  %8.4f s", scene.name.c_str(),
                  target, point.error, point.claimed, point.samples - point.audit_samples, point.audit_samples,
                  point.seconds);
      if (const auto equal = uniform.at(point.error)) {
        std::printf("   uniform %7.2f  %8.4f s  %6.2f x  rays %6.2f x", equal->samples, equal->seconds,
                    equal->seconds / point.seconds, equal->rays / point.rays);
        for (Gains* gains : {&all_, &of_kind_[kind], &of_target_[-target]}) gains->add(*equal, point);
      }
      std::printf("\n");
    }
  }

  void keep(const Case& scene, const Standard* standard, const Options& options) {
    for (const double budget : options.budgets)
      for (std::uint32_t i = 0; i < options.repeats; ++i) {
        const Purchase point = bought(scene, standard, adaptive_to({}, budget, ++budgets_), options.threads);
        const double overrun = point.elapsed_ms - budget;
        std::printf("%-20s budget %5.0f  error %7.3f  claimed %7.3f  samples %7.2f  overrun %6.1f ms\n",
                    scene.name.c_str(), budget, point.error, point.claimed, point.samples, overrun);
        allowed_ += overrun <= 0.05 * budget + 5 ? 1 : 0;
        overruns_.push_back(overrun / budget);
        if (standard == nullptr) continue;
        covered_ += point.error <= point.claimed + standard->reference.error() ? 1 : 0;
        ++judged_;
      }
  }

  void sum_up() {
    for (const auto& [kind, gains] : of_kind_) gains.print(kind);
    for (const auto& [negative, gains] : of_target_) {
      std::ostringstream target;
      target << "target " << -negative;
      gains.print(target.str());
    }
    all_.print("all");
    if (overruns_.empty()) return;
    std::sort(overruns_.begin(), overruns_.end());
    const std::size_t count = overruns_.size();
    std::printf(
        "budgets: %zu of %zu within 5 %% + 5 ms; overrun %.1f %% in the median, %.1f %% at p99, %.1f %% at most\n",
        allowed_, count, 100 * overruns_[count / 2], 100 * overruns_[(count - 1) * 99 / 100], 100 * overruns_.back());
    if (judged_ > 0) std::printf("budgets: the truth is within what is claimed in %zu of %zu\n", covered_, judged_);
  }

 private:
  Gains all_;
  std::map<std::string, Gains> of_kind_;
  std::map<double, Gains> of_target_;  ///< by the target's negative: the coarsest first
  std::vector<double> overruns_;
  std::size_t allowed_ = 0, covered_ = 0, judged_ = 0, budgets_ = 0;
};

/// What a reference must be for the size: that of small images as honesty_table has it.
ReferenceEffort effort_for(const Options& options) {
  if (options.scale == 1 && options.width == 0) return {};
  return {.samples = 256, .images_min = 3, .images_max = 6, .error_wanted = 0.1};
}

void run(const Options& options) {
  Table table;
  const std::pair<const char*, std::vector<Case>> kinds[] = {
      {"shapes", shape_cases()},     {"lights", light_cases()}, {"materials", material_cases()},
      {"textures", texture_cases()}, {"views", view_cases()},   {"traps", trap_cases()}};
  for (const auto& [kind, cases] : kinds)
    for (Case scene : cases) {
      const auto& only = options.scenes;
      if (!only.empty() && std::find(only.begin(), only.end(), scene.name) == only.end()) continue;
      if ((options.scale > 1 || options.width > 0) && scene.scene.image.crop) continue;
      tracer::ImageSize& image = scene.scene.image;
      image.width = options.width > 0 ? options.width : image.width * options.scale;
      image.height = options.height > 0 ? options.height : image.height * options.scale;
      std::optional<Standard> standard;
      if (options.references != "none")
        standard = Standard{reference_of(scene, effort_for(options), options.references), strata_of(scene, 0)};
      if (standard) table.compare(scene, *standard, kind, options.targets);
      table.keep(scene, standard ? &*standard : nullptr, options);
      std::fflush(stdout);
    }
  table.sum_up();
}

}  // namespace

int main(int count, char** values) try {
  const std::vector<std::string> arguments(values + 1, values + count);
  if (std::find(arguments.begin(), arguments.end(), "--help") != arguments.end()) {
    std::fputs(usage, stdout);
    return 0;
  }
  run(parse(arguments));
  return 0;
} catch (const std::exception& problem) {
  std::fprintf(stderr, "budget_table: %s\n%s", problem.what(), usage);
  return 2;
}
