#pragma once
/// The converged image of a scene by a path that knows nothing of adaptive sampling, and how far from converged it
/// still is.
///
/// Many images of as many fixed samples in every pixel, each with a seed of its own, summed in double. What they
/// differ by among themselves is the reference's own error. Nothing is approximated: branches end below a weight of
/// 1e-9, depth at 2000, and textures are looked up at points instead of over what a sample covers, which is what
/// filtering converges to.

#include <cstdint>
#include <filesystem>

#include "tests/honesty/corpus.h"
#include "tests/honesty/levels.h"

namespace honesty {

struct ReferenceEffort {
  std::uint32_t samples = 1024;   ///< in each pixel of each image
  std::uint32_t images_min = 8;   ///< 8192 samples a pixel; enough to know how far they lie apart
  std::uint32_t images_max = 24;  ///< where the error stays above what is wanted
  double error_wanted = 0.02;     ///< levels: under a tenth of the finest claim that is asked for, 0.25
  std::uint32_t threads = 0;      ///< 0: all
};

struct Reference {
  LevelImage linear;    ///< mean of the images
  LevelImage levels;    ///< of that
  LevelImage variance;  ///< of each of `levels`, by the spread of the images
  std::uint32_t images = 0;

  /// Standard error of the whole, levels: root of the mean variance.
  [[nodiscard]] double error() const;
};

/// Kept as a file in `directory` under the scene's name and what it looks like, taken up from there and continued where
/// more is wanted; an empty path keeps nothing. Throws std::runtime_error where the scene cannot be rendered.
Reference reference_of(const Case& scene, const ReferenceEffort& effort, const std::filesystem::path& directory = {});

/// The scene as the reference renders it, for one seed.
tracer::Scene exact_scene(const tracer::Scene& scene, std::uint32_t samples, std::uint64_t seed);

}  // namespace honesty
