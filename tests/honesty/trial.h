#pragma once
/// One image that was asked for with a target error, held against the reference.

#include <array>
#include <cstdint>
#include <vector>

#include "tests/honesty/reference.h"
#include "tests/honesty/strata.h"
#include "tracer/render.h"

namespace honesty {

/// What images of a case are judged by.
struct Standard {
  Reference reference;
  std::vector<Stratum> strata;
};

/// A claim and the truth about some pixels.
struct Share {
  std::size_t pixels = 0;
  double truth = 0;    ///< levels, root mean square
  double claimed = 0;  ///< likewise, of the layer `error`
};

struct Trial {
  double target = 0;
  std::uint64_t seed = 0;
  tracer::ErrorEstimate error;  ///< as claimed
  /// Levels: root mean square of the difference from the reference, less what the reference itself contributes to it.
  double truth = 0;
  double reference_error = 0;
  double samples_per_pixel = 0;  ///< in the image's means, and those that only estimate the error
  std::array<Share, stratum_names.size()> strata{};

  /// The reference is too coarse to judge this claim sharply: then its error is granted to the claim.
  [[nodiscard]] bool coarse() const { return reference_error > 0.1 * error.estimate; }
  [[nodiscard]] bool covered() const { return truth <= error.estimate + (coarse() ? reference_error : 0); }
  /// 1 where both are nothing.
  [[nodiscard]] double ratio() const;
  /// Whether the claim tells the truth within [0.4, 1.05].
  [[nodiscard]] bool close() const { return ratio() >= 0.4 && ratio() <= 1.05; }
};

/// The image of `target` levels and `seed`, as a document asks for it that says no more, with the layer `error`.
tracer::Rendered rendered_to(const Case& scene, double target, std::uint64_t seed, std::uint32_t threads);

/// Any image of the case against its standard.
Trial judged(const Case& scene, const Standard& standard, const tracer::Rendered& rendered, double target,
             std::uint64_t seed);

/// A tracer with a bug that few pixels show: in one pixel of a hundred, chosen by a hash, `image` is given what
/// `without_light` has there.
void seed_bias(tracer::Image& image, const tracer::Image& without_light, std::uint64_t seed);

/// The case without its first light. Precondition: it has one.
Case without_light(const Case& scene);

}  // namespace honesty
