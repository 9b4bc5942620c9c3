#pragma once
/// Converged image of a scene, computed without adaptive sampling, and its standard error.
///
/// It is the mean of many images with the same number of fixed samples and different seeds. The spread of the images
/// gives the standard error of the reference. It uses no approximation: secondary rays end below a throughput of 1e-9
/// or at depth 2000, and textures are evaluated at points instead of filtered, to which filtering converges.

#include <cstdint>
#include <filesystem>

#include "tests/statistics/code_values.h"
#include "tests/statistics/scene_corpus.h"

namespace statistics {

struct ReferenceSettings {
  std::uint32_t samples = 1024;   ///< in each pixel of each image
  std::uint32_t images_min = 8;   ///< 8192 samples a pixel; enough to estimate the spread
  std::uint32_t images_max = 24;  ///< used while the error exceeds the target
  double target_error = 0.02;     ///< code values; less than a tenth of the smallest target, 0.25
  std::uint32_t threads = 0;      ///< 0: all
};

struct ReferenceImage {
  CodeValueImage linear;       ///< mean of the images
  CodeValueImage code_values;  ///< display transform of `linear`
  CodeValueImage variance;     ///< variance of each of `code_values`, from the spread of the images
  std::uint32_t images = 0;

  /// Standard error of the whole image in code values: root of the mean variance.
  [[nodiscard]] double error() const;
};

/// Reads the images that `directory` has for this scene, renders those that are missing, and writes them there; an
/// empty path stores nothing. Throws std::runtime_error if the scene cannot be rendered.
ReferenceImage compute_reference(const Case& scene, const ReferenceSettings& settings,
                                 const std::filesystem::path& directory = {});

/// The scene as the reference renders it, for one seed.
tracer::Scene exact_scene(const tracer::Scene& scene, std::uint32_t samples, std::uint64_t seed);

}  // namespace statistics
