#pragma once
/// The sets of samples of a tile's pixels, as many as the class of each pixel needs, and what they show.

#include <span>
#include <vector>

#include "tracer/src/sampling/class_allocation.h"
#include "tracer/src/sampling/film.h"
#include "tracer/src/sampling/pixel_classes.h"
#include "tracer/src/sampling/sample_sets.h"
#include "tracer/src/sampling/tile_errors.h"

namespace tracer {

/// Looks at pixels that keep their pilot: fresh halves show the pilot's error. Each stands for many pixels (Horvitz and
/// Thompson 1952, "A generalization of sampling without replacement from a finite universe").
struct LookStatistics {
  double looks = 0;
  double error = 0;     ///< sum of the squared errors over the pixels that they stand for; may be negative
  double squares = 0;   ///< sum of the squares of its terms
  double pixels = 0;    ///< sum of the pixels that they stand for
  double expected = 0;  ///< sum of the errors that were expected of these
  void add(const LookStatistics& other) {
    looks += other.looks;
    error += other.error;
    squares += other.squares;
    pixels += other.pixels;
    expected += other.expected;
  }
  /// Multiplies the squared errors.
  void scale(double scale) {
    error *= scale;
    squares *= scale * scale;
    expected *= scale;
  }
};

/// Looks by the class of their pixels.
struct LookBook {
  ByClass<LookStatistics> all{};
  ByClass<LookStatistics> finds{};  ///< those that differ much more than expected
  void add(const LookBook& other) {
    for (std::size_t c = 0; c < class_count; ++c) {
      all[c].add(other.all[c]);
      finds[c].add(other.finds[c]);
    }
  }
  void scale(double scale) {
    for (std::size_t c = 0; c < class_count; ++c) {
      all[c].scale(scale);
      finds[c].scale(scale);
    }
  }
  /// True if few looks at the class are finds: they then show something at their places and nothing about the others.
  [[nodiscard]] bool finds_are_rare(std::size_t c) const {
    constexpr double rare = 1.0 / 16;
    return finds[c].looks < rare * all[c].looks;
  }
};

/// Statistics of the samples of some tiles.
struct TileBook {
  ByClass<ClassStatistics> classes{};
  ByClass<double> first_sets{};  ///< pixels that have lost their pilot to samples
  LookBook looks{};
  std::vector<std::uint32_t> finds{};  ///< pixels whose samples differ from a pilot that none of its neighbors doubts
  void add(const TileBook& other) {
    for (std::size_t c = 0; c < class_count; ++c) {
      classes[c].add(other.classes[c]);
      first_sets[c] += other.first_sets[c];
    }
    looks.add(other.looks);
    finds.insert(finds.end(), other.finds.begin(), other.finds.end());
  }
  void scale(double scale) {
    for (ClassStatistics& each : classes) each.scale(scale);
    looks.scale(scale);
  }
};

/// Samples of the next sets of pixels.
struct SetsPlan {
  ByClass<std::uint32_t> samples{};    ///< by class; 0: none
  ByClass<float> measured{};           ///< share of its pixels that have independent halves
  ByClass<double> look_probability{};  ///< in a class without samples
  ByClass<double> kept{};              ///< error that is expected of its pilot
  ByClass<double> pilot_weight{};      ///< weight of the pilot beside samples; 0: they replace it
  std::uint32_t round = 0;
  /// By tile of TileErrors: samples of a pixel relative to those that it has; empty: only those of the classes.
  std::vector<float> growth{};
  std::uint32_t samples_max = 0;  ///< the most for a pixel, with those that it has
};

/// The sets of a tile in a round.
std::vector<SampleSets> plan_tile(const CompiledScene& scene, const Film& film, const Tiles& tiles, std::uint64_t tile,
                                  std::span<const PixelClass> classes, const SetsPlan& plan);

/// Squared error of a mean with this deviation, in squared code values, summed over the channels. The curve from
/// radiance to code values is steepest next to black: the difference to the darker side is taken, lest dark errors be
/// underestimated.
double squared_error(const Color& mean, const Color& deviation, const DisplayTransform& display);

/// Merges the means of sets into the film and the book. References must outlive it. Sets of different pixels may be
/// merged concurrently into different books.
class TileMerger {
 public:
  TileMerger(Film& film, std::span<const PixelClass> classes, const SetsPlan& plan, const SampleDecay& decay,
             const DisplayTransform& display)
      : film_(film), classes_(classes), plan_(plan), decay_(decay), display_(display) {}

  void merge(const SampleSets& sets, const SetSums& sums, TileBook& book) const;

 private:
  struct PilotError {
    double squared = 0;
    bool find = false;  ///< much more than expected
  };
  [[nodiscard]] PilotError pilot_error(std::size_t place, const SetSums& sums) const;
  void look(std::size_t place, const SetSums& sums, TileBook& book) const;

  Film& film_;
  std::span<const PixelClass> classes_;
  const SetsPlan& plan_;
  const SampleDecay& decay_;
  const DisplayTransform& display_;
};

}  // namespace tracer
