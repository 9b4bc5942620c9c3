// Coverage of error estimates: renders the corpus and scenes of a random grammar, compares each claimed error with the
// true one, and prints the statistics of every family. Exit code 1 if a hypothesis is rejected.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <random>
#include <set>
#include <sstream>
#include <stdexcept>

#include "tests/statistics/error_coverage/trial_runner.h"

namespace {

using namespace error_coverage;

constexpr std::string_view usage =
    R"(error_coverage_table [options]: claimed against true errors at 160 x 120, 320 x 240 and 1280 x 720.
  --families a,b   these only: beginnings of "family: scene"
  --random N       number of random scenes; default 60
  --seed N         seed of the random scenes; default: a new one, which is printed
  --json FILE      every trial
)";

constexpr const char* random_family = "random grammar";

struct Options {
  std::vector<std::string> families;
  std::uint32_t random_scenes = 60;
  std::uint64_t seed = std::random_device{}();
  std::string json;

  [[nodiscard]] bool includes(const std::string& name) const {
    return families.empty() ||
           std::ranges::any_of(families, [&](const auto& begin) { return name.starts_with(begin); });
  }
};

/// Throws std::invalid_argument.
Options parse(const std::vector<std::string>& arguments) {
  Options options;
  for (std::size_t i = 1; i < arguments.size(); i += 2) {
    const std::string& name = arguments[i];
    if (i + 1 == arguments.size()) throw std::invalid_argument(name + " is no option or requires a value");
    std::istringstream value(arguments[i + 1]);
    if (name == "--families") {
      for (std::string part; std::getline(value, part, ',');) options.families.push_back(part);
    } else if (name == "--random") {
      value >> options.random_scenes;
    } else if (name == "--seed") {
      value >> options.seed;
    } else if (name == "--json") {
      options.json = value.str();
    } else {
      throw std::invalid_argument("unknown option " + name);
    }
    if (value.fail() && !value.eof()) throw std::invalid_argument(name + " requires a number");
  }
  return options;
}

/// A seed that depends on the text alone (FNV-1a).
std::uint64_t seed_of(const std::string& text) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return hash;
}

class Trials {
 public:
  /// All sizes; 1280 x 720 for the first entry of a family only.
  void run(const CorpusEntry& entry) {
    const bool slow =
        !entry.exact || entry.settings == SettingGroup::bounds || entry.settings == SettingGroup::noisy_tiles;
    const bool first = families_.insert(entry.family).second;
    const std::vector<Setting> settings = settings_of(entry.settings);
    run(entry, {160, 120}, entry.family == "examples" ? 1 : slow ? 2 : 4, settings);
    if (slow) return;
    run(entry, {320, 240}, 2, settings);
    if (first) run(entry, {1280, 720}, 1, {settings[0], settings[1]});
  }

  void run_random(std::uint64_t seed) {
    const GrammarScene random = grammar_scene(seed);
    const CorpusEntry entry{random_family, random.scene.exact ? "closed form" : "solids"};
    const TrialRunner runner(entry, random.canvas, random.scene);
    oracle::Random settings(seed + 1);
    for (int repetition = 0; repetition < 2; ++repetition) add(runner.run(random_setting(settings), seed + repetition));
  }

  [[nodiscard]] const std::vector<Trial>& all() const { return trials_; }

 private:
  void run(const CorpusEntry& entry, Canvas canvas, std::uint32_t placements, const std::vector<Setting>& settings) {
    for (std::uint32_t i = 0; i < placements; ++i) {
      const std::uint64_t seed = seed_of(entry.family + entry.name + std::to_string(canvas.width)) + i;
      oracle::Random random(seed);
      const CorpusScene scene = entry.build(canvas, random);
      const TrialRunner runner(entry, {scene.scene.image.width, scene.scene.image.height}, scene);
      for (const Setting& setting : settings) add(runner.run(setting, seed ^ seed_of(setting.name())));
    }
  }

  void add(const std::vector<Trial>& trials) { trials_.insert(trials_.end(), trials.begin(), trials.end()); }

  std::vector<Trial> trials_;
  std::set<std::string> families_;
};

void print_row(const std::string& name, const ClaimStatistics& statistics) {
  std::cout << std::left << std::setw(58) << name << std::right << std::fixed << std::setprecision(1) << std::setw(7)
            << statistics.trials << std::setw(8) << statistics.broken << std::setw(7) << 100 * statistics.broken_share()
            << " %" << std::setw(10) << std::scientific << statistics.p_value() << std::fixed << std::setw(10)
            << statistics.disproved << std::setw(7) << 100 * statistics.close_share() << " %" << std::setw(8)
            << statistics.underclaimed << std::setw(11) << statistics.target_exceeded
            << (statistics.rejected() ? "  REJECT" : "") << "\n";
}

/// Prints the statistics of the trials with the same key, in the order of their first appearance; false if one is
/// rejected.
template <class Key>
bool print_groups(const std::string& heading, const std::vector<Trial>& trials, bool only_rejected, const Key& key) {
  using Group = std::pair<std::string, ClaimStatistics>;
  std::vector<Group> groups;
  for (const Trial& trial : trials) {
    auto found = std::ranges::find(groups, key(trial), &Group::first);
    if (found == groups.end()) found = groups.insert(found, {key(trial), {}});
    found->second.add(trial);
  }
  std::cout << "\n"
            << std::left << std::setw(58) << heading << std::right << std::setw(7) << "trials" << std::setw(8)
            << "broken" << std::setw(9) << "share" << std::setw(10) << "p" << std::setw(10) << "disproved"
            << std::setw(9) << "close" << std::setw(8) << "< 10 %" << std::setw(11) << "exceeded"
            << "\n";
  bool accepted = true;
  for (const auto& [name, statistics] : groups) {
    if (!only_rejected || statistics.rejected()) print_row(name, statistics);
    accepted &= !statistics.rejected();
  }
  return accepted;
}

/// False if a hypothesis is rejected.
bool print_summary(const std::vector<Trial>& trials) {
  const auto is_random = [](const Trial& trial) { return trial.family == random_family; };
  bool accepted = print_groups("family", trials, false, [](const Trial& trial) { return trial.family; });
  accepted &= print_groups("setting", trials, false,
                           [&](const Trial& trial) { return is_random(trial) ? "random setting" : trial.setting; });
  accepted &= print_groups("size", trials, false, [&](const Trial& trial) {
    const auto [width, height] = trial.canvas;
    return is_random(trial) ? "random size" : std::to_string(width) + " x " + std::to_string(height);
  });
  accepted &= print_groups("rejected scene", trials, true,
                           [](const Trial& trial) { return trial.family + ": " + trial.scene; });
  accepted &= print_groups("", trials, false, [](const Trial&) { return std::string("all"); });
  ClaimStatistics all;
  for (const Trial& trial : trials) all.add(trial);
  const bool tight = all.close_share() >= close_share_min;
  std::cout << "\n" << (accepted ? "the claims cover the truth\n" : "REJECT: the claims do not cover the truth\n");
  if (!tight) std::cout << "REJECT: fewer than " << 100 * close_share_min << " % of the claims are close\n";
  return accepted && tight;
}

void write_json(const std::vector<Trial>& trials, const std::string& file) {
  std::ofstream out(file);
  out << std::boolalpha << "[";
  for (const Trial& trial : trials) {
    out << (&trial == trials.data() ? "\n" : ",\n") << R"({"family": ")" << trial.family << R"(", "scene": ")"
        << trial.scene << R"(", "setting": ")" << trial.setting << R"(", "width": )" << trial.canvas.width
        << R"(, "height": )" << trial.canvas.height << R"(, "seed": )" << trial.seed << R"(, "claimed": )"
        << trial.claimed << R"(, "true": )" << trial.truth() << R"(, "true_lower": )" << trial.truth_lower()
        << R"(, "proven": )" << (std::isfinite(trial.proven) ? trial.proven : -1) << R"(, "met": )" << trial.target_met
        << R"(, "broken": )" << trial.broken() << R"(, "samples_per_pixel": )" << trial.samples_per_pixel << "}";
  }
  out << "\n]\n";
  if (!out.flush()) throw std::runtime_error("cannot write " + file);
}

int run(const Options& options) {
  std::cout << "random scenes: --seed " << options.seed << std::endl;
  Trials trials;
  for (const CorpusEntry& entry : corpus())
    if (options.includes(entry.family + ": " + entry.name)) trials.run(entry);
  oracle::Random seeds(options.seed);
  for (std::uint32_t i = 0; i < options.random_scenes && options.includes(random_family); ++i)
    trials.run_random(static_cast<std::uint64_t>(seeds.in(0, 1) * 0x1p53));
  if (!options.json.empty()) write_json(trials.all(), options.json);
  return print_summary(trials.all()) ? 0 : 1;
}

}  // namespace

int main(int count, char** values) {
  try {
    return run(parse({values, values + count}));
  } catch (const std::exception& problem) {
    std::cerr << "error_coverage_table: " << problem.what() << "\n" << usage;
    return 2;
  }
}
