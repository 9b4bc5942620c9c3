// Coverage of error estimates: renders the corpus and scenes of a random grammar, compares each claimed error with the
// true one, and prints the statistics of every family. Exit code 1 if a hypothesis is rejected.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <limits>
#include <map>
#include <optional>
#include <random>
#include <stdexcept>

#include "tests/statistics/error_coverage/trial_runner.h"

namespace {

using namespace error_coverage;

constexpr std::string_view usage =
    R"(error_coverage_table [options]: claimed against true errors at 160 x 120, 320 x 240 and 1280 x 720.
  --long             more placements, sizes and time budgets, 500 random scenes; much longer
  --families a,b     these only: beginnings of the lines that --list prints, "family: scene"
  --seed N           seed of the random scenes; default: a new one, which is printed
  --grammar N        number of random scenes; default 60
  --scene SEED       only the random scene whose first trial has this seed in the file of --json
  --placements N     placements of the features at 160 x 120; default 4
  --width N          no wider images of the corpus
  --json FILE        every trial
  --references DIR   cache of reference images; default: error-references beside the directory of this program
  --threads N        default: all
)";

constexpr const char* grammar_family = "random grammar";

struct Options {
  bool extended = false, list = false;
  std::vector<std::string> families;
  std::uint64_t seed = 0;
  std::optional<std::uint64_t> scene;
  std::uint32_t grammar_scenes = 0, placements = 0, width_max = std::numeric_limits<std::uint32_t>::max();
  std::filesystem::path json;
  ReferenceOptions references;

  [[nodiscard]] bool includes(const std::string& family) const {
    return families.empty() || std::any_of(families.begin(), families.end(),
                                           [&](const std::string& begin) { return family.starts_with(begin); });
  }
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
  bool grammar_set = false;
  options.seed = std::random_device{}();
  options.references.directory =
      std::filesystem::absolute(arguments[0]).parent_path().parent_path() / "error-references";
  for (std::size_t i = 1; i < arguments.size(); ++i) {
    const std::string& name = arguments[i];
    const auto value = [&] {
      if (i + 1 == arguments.size()) throw std::invalid_argument(name + " requires a value");
      return arguments[++i];
    };
    const auto number = [&] { return static_cast<std::uint32_t>(std::stoul(value())); };
    if (name == "--long") {
      options.extended = true;
    } else if (name == "--list") {
      options.list = true;
    } else if (name == "--families") {
      options.families = split(value());
    } else if (name == "--seed") {
      options.seed = std::stoull(value());
    } else if (name == "--scene") {
      options.scene = std::stoull(value());
      options.families = {grammar_family};
    } else if (name == "--grammar") {
      options.grammar_scenes = number();
      grammar_set = true;
    } else if (name == "--placements") {
      options.placements = number();
    } else if (name == "--width") {
      options.width_max = number();
    } else if (name == "--json") {
      options.json = value();
    } else if (name == "--references") {
      options.references.directory = value();
    } else if (name == "--threads") {
      options.references.threads = number();
    } else {
      throw std::invalid_argument("unknown option " + name);
    }
  }
  if (!grammar_set) options.grammar_scenes = options.extended ? 500 : 60;
  if (options.scene) options.grammar_scenes = 1;
  if (options.placements == 0) options.placements = options.extended ? 8 : 4;
  if (options.extended) options.references.samples = 20e6;
  return options;
}

/// A seed that depends on the text alone (FNV-1a).
std::uint64_t seed_of(const std::string& text) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return hash;
}

/// Statistics of each group of trials, in the order of their first appearance.
class Groups {
 public:
  void add(const std::string& name, const Trial& trial) {
    const auto [found, inserted] = index_.try_emplace(name, groups_.size());
    if (inserted) groups_.push_back({name, {}});
    groups_[found->second].second.add(trial);
  }
  [[nodiscard]] const auto& all() const { return groups_; }
  [[nodiscard]] bool rejected() const {
    return std::any_of(groups_.begin(), groups_.end(), [](const auto& group) { return group.second.rejected(); });
  }

 private:
  std::map<std::string, std::size_t> index_;
  std::vector<std::pair<std::string, ClaimStatistics>> groups_;
};

constexpr int name_width = 58;

void print_heading(const std::string& name) {
  std::cout << "\n"
            << std::left << std::setw(name_width) << name << std::right << std::setw(7) << "trials" << std::setw(8)
            << "broken" << std::setw(9) << "share" << std::setw(10) << "p" << std::setw(10) << "disproved"
            << std::setw(9) << "close" << std::setw(8) << "< 10 %" << std::setw(11) << "exceeded" << std::endl;
}

void print_row(const std::string& name, const ClaimStatistics& statistics) {
  std::cout << std::left << std::setw(name_width) << name << std::right << std::fixed << std::setprecision(1)
            << std::setw(7) << statistics.trials << std::setw(8) << statistics.broken << std::setw(7)
            << 100 * statistics.broken_share() << " %" << std::setw(10) << std::scientific << statistics.p_value()
            << std::fixed << std::setw(10) << statistics.disproved << std::setw(7) << 100 * statistics.close_share()
            << " %" << std::setw(8) << statistics.underclaimed << std::setw(11) << statistics.target_exceeded
            << (statistics.rejected() ? "  REJECT" : "") << std::endl;
}

class Table {
 public:
  explicit Table(const Options& options) : options_(options) {}

  void run_corpus() {
    std::string family;
    for (const CorpusEntry& entry : corpus(WHITTLE_SOURCE_DIR)) {
      if (!options_.includes(entry.family + ": " + entry.name) || (entry.extended && !options_.extended)) continue;
      if (entry.family != family) print_family(family);
      run_sizes(entry, entry.family != family);
      family = entry.family;
    }
    print_family(family);
  }

  void run_grammar() {
    if (!options_.includes(grammar_family)) return;
    oracle::Random seeds(options_.seed);
    const Canvas largest = options_.extended ? Canvas{640, 480} : Canvas{320, 240};
    for (std::uint32_t i = 0; i < options_.grammar_scenes; ++i) {
      const std::uint64_t seed = options_.scene.value_or(static_cast<std::uint64_t>(seeds.in(0, 1) * 0x1p53));
      const GrammarScene random = grammar_scene(seed, largest);
      const CorpusEntry entry{grammar_family, random.scene.exact ? "closed form" : "solids"};
      const TrialRunner runner(entry, random.canvas, random.scene, options_.references);
      oracle::Random settings(seed + 1);
      for (int repetition = 0; repetition < 2; ++repetition)
        add(runner.run(random_setting(settings), seed + repetition));
    }
    print_family(grammar_family);
  }

  /// Prints the statistics over all families; false if one is rejected.
  [[nodiscard]] bool print_summary() const;
  void write_json(std::ostream& out) const;

 private:
  /// All sizes; 1280 x 720 for the first entry of a family only.
  void run_sizes(const CorpusEntry& entry, bool first) {
    const bool slow =
        !entry.exact || entry.settings == SettingGroup::bounds || entry.settings == SettingGroup::noisy_tiles;
    const std::vector<Setting> settings = settings_of(entry.settings, options_.extended);
    const std::uint32_t fewer = entry.family == "examples" ? 1 : (options_.placements + 1) / 2;
    run_entry(entry, {160, 120}, slow ? fewer : options_.placements, settings);
    if (!slow || options_.extended) run_entry(entry, {320, 240}, fewer, settings);
    if (first && !slow) run_entry(entry, {1280, 720}, 1, {settings[0], settings[1]});
  }

  void run_entry(const CorpusEntry& entry, Canvas canvas, std::uint32_t placements,
                 const std::vector<Setting>& settings) {
    if (canvas.width > options_.width_max) return;
    for (std::uint32_t i = 0; i < placements; ++i) {
      const std::uint64_t seed = seed_of(entry.family + entry.name + std::to_string(canvas.width)) + i;
      oracle::Random random(seed);
      const CorpusScene scene = entry.build(canvas, random);
      const TrialRunner runner(entry, {scene.scene.image.width, scene.scene.image.height}, scene, options_.references);
      for (const Setting& setting : settings) add(runner.run(setting, seed ^ seed_of(setting.name())));
    }
  }

  /// Nothing if the family has no trials.
  void print_family(const std::string& family) const {
    ClaimStatistics statistics;
    for (const Trial& trial : trials_)
      if (trial.family == family) statistics.add(trial);
    if (statistics.trials > 0) print_row(family, statistics);
  }

  void add(const std::vector<Trial>& trials) { trials_.insert(trials_.end(), trials.begin(), trials.end()); }

  const Options& options_;
  std::vector<Trial> trials_;
};

void print_groups(const std::string& heading, const Groups& groups, bool only_rejected) {
  print_heading(heading);
  for (const auto& [name, statistics] : groups.all())
    if (!only_rejected || statistics.rejected()) print_row(name, statistics);
}

bool Table::print_summary() const {
  Groups families, settings, canvases, scenes;
  ClaimStatistics all;
  for (const Trial& trial : trials_) {
    families.add(trial.family, trial);
    const bool random = trial.family == grammar_family;
    settings.add(random ? "random setting" : trial.setting, trial);
    canvases.add(
        random ? "random size" : std::to_string(trial.canvas.width) + " x " + std::to_string(trial.canvas.height),
        trial);
    scenes.add(trial.family + ": " + trial.scene, trial);
    all.add(trial);
  }
  print_groups("setting", settings, false);
  print_groups("size", canvases, false);
  print_groups("rejected scene", scenes, true);
  print_heading("");
  print_row("all", all);
  const bool rejected =
      all.rejected() || families.rejected() || settings.rejected() || canvases.rejected() || scenes.rejected();
  const bool tight = all.close_share() >= close_share_min;
  std::cout << "\n" << (rejected ? "REJECT: the claims do not cover the truth\n" : "the claims cover the truth\n");
  if (!tight) std::cout << "REJECT: fewer than " << 100 * close_share_min << " % of the claims are close\n";
  return !rejected && tight;
}

void Table::write_json(std::ostream& out) const {
  const char* separator = "[\n";
  for (const Trial& trial : trials_) {
    out << separator << R"({"family": ")" << trial.family << R"(", "scene": ")" << trial.scene << R"(", "setting": ")"
        << trial.setting << R"(", "width": )" << trial.canvas.width << ", \"height\": " << trial.canvas.height
        << ", \"seed\": " << trial.seed << ", \"claimed\": " << trial.claimed << ", \"true\": " << trial.truth()
        << ", \"true_lower\": " << trial.truth_lower()
        << ", \"proven\": " << (std::isfinite(trial.proven) ? trial.proven : -1) << ", \"tone\": " << trial.tone
        << ", \"worst_tile\": " << std::sqrt(std::max(0.0, trial.error.worst_tile))
        << ", \"met\": " << (trial.target_met ? "true" : "false")
        << ", \"broken\": " << (trial.broken() ? "true" : "false")
        << ", \"samples_per_pixel\": " << trial.samples_per_pixel << "}";
    separator = ",\n";
  }
  out << (trials_.empty() ? "[]\n" : "\n]\n");
}

int run(const Options& options) {
  if (options.list) {
    for (const CorpusEntry& entry : corpus(WHITTLE_SOURCE_DIR)) std::cout << entry.family << ": " << entry.name << "\n";
    return 0;
  }
  std::cout << "random scenes: --seed " << options.seed << "\n";
  print_heading("family");
  Table table(options);
  table.run_corpus();
  table.run_grammar();
  const bool accepted = table.print_summary();
  if (!options.json.empty()) {
    std::ofstream json(options.json);
    table.write_json(json);
    if (!json.flush()) throw std::runtime_error("cannot write " + options.json.string());
  }
  return accepted ? 0 : 1;
}

}  // namespace

int main(int count, char** values) {
  const std::vector<std::string> arguments(values, values + count);
  try {
    if (std::find(arguments.begin(), arguments.end(), "--help") != arguments.end()) {
      std::cout << usage;
      return 0;
    }
    return run(parse(arguments));
  } catch (const std::exception& problem) {
    std::cerr << "error_coverage_table: " << problem.what() << "\n" << usage;
    return 2;
  }
}
