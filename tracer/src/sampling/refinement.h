#pragma once
/// The decisions of adaptive sampling: the class of each pixel, the samples of its next sets, and the error of the
/// image so far. Nothing here traces a ray.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "tracer/accuracy.h"
#include "tracer/src/parallel/parallel_for.h"
#include "tracer/src/sampling/class_allocation.h"
#include "tracer/src/sampling/error_estimate.h"
#include "tracer/src/sampling/film.h"
#include "tracer/src/sampling/tile_errors.h"
#include "tracer/src/sampling/tile_sets.h"

namespace tracer {

/// Errors below this are invisible: levels.
inline constexpr double invisible_error = 0.1;

class Refinement {
 public:
  /// References must outlive it. The pilots of `film` are complete before classify().
  Refinement(const Film& film, const Tiles& tiles, const Adaptive& target, SampleDecay decay)
      : film_(film), tiles_(tiles), target_(target), decay_(decay), classes_(film.size()) {}

  /// Sorts the pixels into classes, those with samples too. `features`: see PilotImage.
  void classify(std::span<const float> features, const DisplayTransform& display, const InParallel& in_parallel);
  [[nodiscard]] bool classified() const { return allocation_.has_value(); }
  [[nodiscard]] std::span<const PixelClass> classes() const { return classes_; }

  /// Squared error that samples cannot lower, over the image.
  void set_fixed(double squared_error) { fixed_ = squared_error; }
  /// The target, likewise.
  [[nodiscard]] double wanted() const;
  /// True if samples may reach the target beside it.
  [[nodiscard]] bool leaves_room() const { return fixed_ < 0.9 * wanted(); }

  /// Begins a round; false if there have been enough.
  bool begin_round();
  /// Part of a round: tiles [first, last) in scattered order.
  struct Step {
    std::uint64_t first = 0, last = 0;
    SetsPlan plan{};
  };
  /// The next part of the round, which may cost `rays`; nothing if it is over or no pixel needs samples. In the first
  /// round each part has better statistics than the one before.
  std::optional<Step> next_step(double rays);
  /// Adds what a step has shown.
  void add(const Step& step, const TileBook& book);
  /// Adds what samples beside the steps have shown, after classify().
  void add(const TileBook& book);
  /// Multiplies all squared errors, for a display of other contrast.
  void scale_errors(double scale);

  /// Estimated error of the image by its samples.
  [[nodiscard]] SampledError error() const;
  [[nodiscard]] std::uint64_t looks() const;
  /// Estimated squared errors of the pixels, by place, in squared code values, summed over the channels.
  [[nodiscard]] std::vector<float> pixel_errors() const;
  [[nodiscard]] TileErrors tile_errors() const;

 private:
  static constexpr std::uint32_t rounds_max = 12;
  /// A fifth of the pixels is measured, drawn by chance: independent halves of strata take 2^((p-1)/p) times the
  /// samples for the same error, so that the rest does without. In a class of few pixels all of them are.
  static constexpr double measured_share = 0.2, measured_min = 64;

  struct Totals {
    double squared = 0, variance = 0;
  };
  /// Sums over the pixels with samples and, by class, so many with pilots. With or without those finds whose
  /// surroundings the next round samples.
  [[nodiscard]] Totals totals(const ByClass<double>& pilots, bool with_finds) const;
  [[nodiscard]] double channels() const { return 3 * static_cast<double>(film_.size()); }
  /// Squared error that samples may leave, over the image.
  [[nodiscard]] double goal() const;
  [[nodiscard]] double look_scale() const;
  [[nodiscard]] LookStatistics shown_by_looks(std::size_t c, double scale, bool with_finds) const;
  [[nodiscard]] ByClass<double> error_of_pilots() const;
  [[nodiscard]] const LookBook& valid_looks() const { return fresh_looks_ ? looks_before_ : found_.looks; }
  /// True for a class whose finds show nothing about its other pixels, while rounds follow that sample around them.
  [[nodiscard]] bool leaves_out_finds(std::size_t c) const {
    constexpr std::uint32_t rounds = 2;  // what is found again and again may be anywhere
    return rounds_ <= rounds && valid_looks().finds_are_rare(c);
  }
  [[nodiscard]] ClassAllocation::Goal goal_of_first_round(double rays) const;
  [[nodiscard]] ClassAllocation::Samples further_samples(double rays) const;
  void set_look_probabilities(SetsPlan& plan) const;
  [[nodiscard]] std::vector<float> growth_of_tiles() const;
  void grow();
  bool take_more_looks();

  const Film& film_;
  const Tiles& tiles_;
  const Adaptive& target_;
  const SampleDecay decay_;
  double fixed_ = 0;
  std::vector<PixelClass> classes_;              ///< by place
  std::vector<ByClass<ClassCount>> counts_;      ///< by tile
  ByClass<double> pixels_{};                     ///< by class
  ByClass<double> kept_{};                       ///< those that have a pilot and no samples
  ByClass<double> left_{};                       ///< those of tiles that the first round has not visited
  ByClass<std::uint32_t> sampled_{}, before_{};  ///< samples of each pixel of the class: now, and before the round
  std::optional<ClassAllocation> allocation_;
  TileBook found_;
  LookBook looks_before_{};   ///< those of earlier rounds, until the round is complete
  double look_factor_ = 1;    ///< looks relative to those of the first round
  bool fresh_looks_ = false;  ///< the round takes looks in place of those before
  std::uint32_t rounds_ = 0;
  std::uint64_t done_ = 0;  ///< tiles of the round
};

}  // namespace tracer
