#pragma once
/// True errors: of a displayed image against a closed form, or against two independent reference images.

#include <array>

#include "tests/statistics/error_coverage/corpus.h"
#include "tracer/compare.h"

namespace error_coverage {

/// Mean squared error in levels, over pixels and channels.
struct MeasuredError {
  double squared = 0;         ///< unbiased; may be negative by chance
  double standard_error = 0;  ///< part of `squared` that the reference images cause; 0 with a closed form
  double worst_tile = 0;      ///< largest squared error of a tile of 16 x 16 pixels
};

/// The converged image after display transform. With X the image and A, B two independent unbiased references,
/// (X - A)(X - B) is an unbiased estimate of the squared error: the noise of A and B cancels.
class Truth {
 public:
  explicit Truth(const tracer::DisplayImage& exact) : halves_{exact, exact} {}
  Truth(tracer::DisplayImage a, tracer::DisplayImage b) : halves_{std::move(a), std::move(b)} {}
  /// Precondition: the sizes are equal.
  [[nodiscard]] MeasuredError error_of(const tracer::DisplayImage& image) const;

 private:
  std::array<tracer::DisplayImage, 2> halves_;
};

/// The scene with uniform samples, without a cutoff or a depth, and without approximations. Textures are
/// looked up at points, to which filtering converges.
tracer::Scene reference_scene(const tracer::Scene& scene, std::uint32_t samples, std::uint64_t seed);

/// Throws std::runtime_error if the scene cannot be rendered. `reference_samples`: number over all pixels, in each of
/// two reference images.
Truth truth_of(const CorpusScene& scene, double reference_samples);

/// Side of the tiles of MeasuredError::worst_tile.
inline constexpr std::uint32_t tile_side = 16;

/// Largest mean of `squared_errors`, one per pixel, over the tiles of an image; tiles at the right and lower edge may
/// be smaller.
double worst_tile_mean(const std::vector<double>& squared_errors, std::uint32_t width);

}  // namespace error_coverage
