#pragma once
/// What adaptive samples cost beside as many in every pixel, at equal true error.
///
/// Uniform samples have a curve of cost over error of their own, measured at powers of two; what they cost for an error
/// that adaptive ones left is read off it, on logarithmic scales. Neither side is charged for what it claims: an image
/// that turned out better than was asked is compared with a uniform one that is as good.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tests/honesty/trial.h"

namespace honesty {

/// An image's cost and what it bought.
struct Purchase {
  double seconds = 0;     ///< of this process's processors, building and tracing: others hardly disturb it
  double elapsed_ms = 0;  ///< by the clock that a budget goes by: the same time on one thread, the wall's on more
  double rays = 0;        ///< of every kind
  double samples = 0, audit_samples = 0;  ///< a pixel; audit_samples are those of `samples` that only estimate
  double error = 0, claimed = 0;          ///< levels: true and told
};

/// The case rendered with `accuracy`, and judged where there is a standard. Throws std::runtime_error where there is no
/// image.
Purchase bought(const Case& scene, const Standard* standard, const tracer::Accuracy& accuracy,
                std::uint32_t threads = 1);

/// Accuracy as a document that asks for one of them has it.
tracer::Accuracy adaptive_to(std::optional<double> target, std::optional<double> budget_ms, std::uint64_t seed);

/// The curve of uniform samples, as far as it is asked for. `scene` and `standard` must outlive it.
class UniformCurve {
 public:
  UniformCurve(const Case& scene, const Standard& standard) : scene_(scene), standard_(standard) {}
  /// What uniform samples cost for that error; nothing where one sample a pixel is better, or more are not.
  std::optional<Purchase> at(double error);

 private:
  static constexpr std::uint32_t samples_max = 1024;
  const Case& scene_;
  const Standard& standard_;
  std::vector<Purchase> points_;  ///< of 1, 2, 4 ... samples
};

/// Between two points, at an error between theirs: on logarithmic scales.
Purchase between(const Purchase& coarse, const Purchase& fine, double error);

}  // namespace honesty
