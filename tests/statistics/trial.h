#pragma once
/// One adaptive image with a target error, compared with the reference.

#include <array>
#include <cstdint>
#include <vector>

#include "tests/statistics/pixel_classes.h"
#include "tests/statistics/reference_image.h"
#include "tracer/render.h"

namespace statistics {

/// Reference of a scene, and the class of each of its pixels.
struct GroundTruth {
  ReferenceImage reference;
  std::vector<PixelClass> pixel_classes;
};

/// True and estimated error of the pixels of one class: root mean square, code values.
struct ClassError {
  std::size_t pixels = 0;
  double true_error = 0;
  double estimated = 0;  ///< from the layer `error`
};

struct Trial {
  double target = 0;
  std::uint64_t seed = 0;
  tracer::ErrorEstimate error;
  /// Root mean square difference from the reference in code values, less the variance of the reference.
  double true_error = 0;
  double reference_error = 0;
  double samples_per_pixel = 0;  ///< those in the image and those that only estimate the error
  std::array<ClassError, pixel_class_names.size()> pixel_classes{};

  /// Returns true if the error of the reference is not small against the estimate; it is then added to the estimate.
  [[nodiscard]] bool reference_is_coarse() const { return reference_error > 0.1 * error.estimate; }
  [[nodiscard]] bool covered() const {
    return true_error <= error.estimate + (reference_is_coarse() ? reference_error : 0);
  }
  /// True over estimated error; 1 if both are 0.
  [[nodiscard]] double ratio() const;
  /// Returns true if the ratio is within [0.4, 1.05].
  [[nodiscard]] bool calibrated() const { return ratio() >= 0.4 && ratio() <= 1.05; }
};

/// Renders the image of `target` code values and `seed`, otherwise with the defaults of a document, and the layer
/// `error`.
tracer::Rendered render_to_target(const Case& scene, double target, std::uint64_t seed, std::uint32_t threads);

/// Compares an image of the case with its ground truth.
Trial evaluate(const Case& scene, const GroundTruth& ground_truth, const tracer::Rendered& rendered, double target,
               std::uint64_t seed);

/// Simulates a defect that affects few pixels: copies one pixel of a hundred, selected by a hash, from `without_light`.
void inject_bias(tracer::Image& image, const tracer::Image& without_light, std::uint64_t seed);

/// The case without its first light. Precondition: it has one.
Case without_light(const Case& scene);

}  // namespace statistics
