#pragma once
/// Renders scenes of the corpus with the settings of their group and measures the true errors.

#include "tests/statistics/error_coverage/claim_statistics.h"
#include "tracer/render.h"

namespace error_coverage {

/// Accuracy that is requested of one render.
struct Setting {
  std::optional<double> target_error{};    ///< levels
  std::optional<double> time_budget_ms{};  ///< with neither: `samples` in every pixel
  std::uint32_t samples = 0;
  /// "target 1", "budget 50 ms", "4 samples".
  [[nodiscard]] std::string name() const;
};

std::vector<Setting> settings_of(SettingGroup group);
/// A setting of the random grammar.
Setting random_setting(oracle::Random& random);

/// tracer::render, or the same with a fault.
using Renderer = tracer::Result<tracer::Rendered, tracer::Failure> (*)(const tracer::CompiledScene&,
                                                                       const tracer::RenderSettings&,
                                                                       tracer::RenderControl&);

/// Renders one scene repeatedly, each time with another seed.
class TrialRunner {
 public:
  /// Throws std::runtime_error if the scene cannot be rendered. References must outlive it.
  TrialRunner(const CorpusEntry& entry, Canvas canvas, const CorpusScene& scene, double reference_samples = 4e6);

  /// The trials of one render: of the image, and with `files` of each file, with measures_tiles() of the worst tile.
  std::vector<Trial> run(const Setting& setting, std::uint64_t seed, Renderer renderer = tracer::render) const;

 private:
  [[nodiscard]] std::vector<Trial> file_trials(const tracer::Rendered& rendered, const Trial& of_image) const;

  const CorpusEntry& entry_;
  Canvas canvas_;
  const CorpusScene& scene_;
  Truth truth_;
};

}  // namespace error_coverage
