#pragma once
/// Scenes for testing error estimates, in families: one for each way in which an estimate can be wrong, ordinary
/// scenes, and scenes of a random grammar. All are larger than the images in which every pixel is validated.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tests/statistics/error_coverage/flat_scene.h"
#include "tests/support/random.h"

namespace error_coverage {

/// Settings that a scene is rendered with.
enum class SettingGroup {
  targets,        ///< target errors of 4 to 0.5 levels
  budgets,        ///< target errors and time budgets
  fixed_samples,  ///< 1 to 64 samples in every pixel
  bounds,         ///< with the depth and the cutoff of the scene
  files,          ///< target errors, compared with the decoded files
  tiles,          ///< target errors, also of the worst tile
  noisy_tiles,    ///< the same with larger targets: small ones take thousands of samples in every pixel
};

struct CorpusScene {
  tracer::Scene scene{};
  tracer::Assets assets{};
  /// Linear radiance of the converged image; unset: it is estimated by two reference images.
  std::optional<tracer::Image> exact{};
};

/// True if the worst tile is measured as well.
constexpr bool measures_tiles(SettingGroup group) {
  return group == SettingGroup::tiles || group == SettingGroup::noisy_tiles;
}

/// A scene for any canvas; `random` places its features.
struct CorpusEntry {
  std::string family{}, name{};
  SettingGroup settings = SettingGroup::targets;
  std::function<CorpusScene(Canvas, oracle::Random&)> build{};
  bool exact = true;  ///< the converged image has a closed form
};

/// Every entry.
std::vector<CorpusEntry> corpus();

/// The entries of each file.
std::vector<CorpusEntry> flat_entries();
std::vector<CorpusEntry> random_entries();
std::vector<CorpusEntry> sampled_entries();
std::vector<CorpusEntry> global_entries();

/// A scene of the random grammar, which depends on the arguments alone. Three in four have a closed form.
struct GrammarScene {
  Canvas canvas;
  CorpusScene scene;
};
GrammarScene grammar_scene(std::uint64_t seed, Canvas largest = {320, 240});

/// The scene and the exact image of `flat`.
CorpusScene finished(FlatScene& flat);
/// A point at least `margin` pixels inside the image.
tracer::Vec2 random_place(Canvas canvas, oracle::Random& random, double margin = 4);
/// `count` points inside the image, pairwise at least `distance` pixels apart, or fewer if the image has no room.
std::vector<tracer::Vec2> random_places(Canvas canvas, oracle::Random& random, int count, double distance);

}  // namespace error_coverage
