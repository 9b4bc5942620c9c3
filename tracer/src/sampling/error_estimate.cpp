#include "tracer/src/sampling/error_estimate.h"

#include <algorithm>
#include <cmath>

#include "tracer/src/math/lanes.h"
#include "tracer/src/math/vec.h"

namespace tracer {
namespace {

/// One-sided 95 % of a normal distribution is 1.645 deviations. The true error is a random sum of squares like its
/// estimate and independent of it, which makes that 2.33 deviations of the estimate. The skew of sums of squares is
/// left to the holdout samples that validate the estimate.
constexpr double deviations = 2.33;
constexpr double holdout_deviations = 1.645;
constexpr double confidence = 0.95;

/// Errors of pilots, measured by holdout samples and classified by contrast.
class HoldoutClasses {
 public:
  void add(const PixelState& pixel) {
    Class& one = of(pixel.contrast);
    one.radiance += holdout_radiance_error(pixel);
    ++one.count;
  }
  void add(const HoldoutClasses& part) {
    for (std::size_t i = 0; i < classes_.size(); ++i) {
      classes_[i].radiance += part.classes_[i].radiance;
      classes_[i].count += part.classes_[i].count;
    }
  }
  /// Error of an added pixel. Precondition: all pixels are added.
  [[nodiscard]] double error(const PixelState& pixel, const DisplayTransform& display) const {
    const Class& one = classes_[index(pixel.contrast)];
    return holdout_error(pixel, display, std::sqrt(std::max(0.0, one.radiance / one.count)));
  }
  /// To be called with the error of every added pixel, in a fixed order, so that the sums are deterministic.
  void add_error(const PixelState& pixel, double error) { of(pixel.contrast).error += error; }
  /// Prediction for any pixel. The prediction from the contrast has the weight of two holdout pixels, which damps small
  /// counts.
  [[nodiscard]] double predicted(const PixelState& pixel) const {
    constexpr double prior_weight = 2;
    const Class& one = classes_[index(pixel.contrast)];
    return std::max(0.0, (one.error + prior_weight * predicted_variance(pixel.contrast)) / (one.count + prior_weight));
  }

 private:
  struct Class {
    double radiance = 0, error = 0, count = 0;
  };
  /// One class per octave of contrast, from 2^-16 squared code values.
  static std::size_t index(double contrast) {
    return contrast > 0 ? static_cast<std::size_t>(std::clamp(std::ilogb(contrast) + 17, 1, 40)) : 0;
  }
  Class& of(double contrast) { return classes_[index(contrast)]; }
  std::array<Class, 41> classes_{};
};

/// Sums of `per_sample` over a pixel and its neighbors; NaN values are not measured.
class Neighborhood {
 public:
  Neighborhood(std::span<const float> per_sample, std::uint32_t width)
      : per_sample_(per_sample), columns_(width), rows_(per_sample.size() / width) {}

  struct Neighbors {
    double sum = 0, count = 0;
    [[nodiscard]] double mean() const { return count > 0 ? sum / count : 0; }
  };
  [[nodiscard]] Neighbors neighbors(std::size_t x, std::size_t y) const {
    Neighbors result;
    for (std::size_t ny = y - std::min<std::size_t>(y, 1); ny <= std::min(rows_ - 1, y + 1); ++ny) {
      for (std::size_t nx = x - std::min<std::size_t>(x, 1); nx <= std::min(columns_ - 1, x + 1); ++nx) {
        const float value = per_sample_[ny * columns_ + nx];
        if (std::isnan(value)) continue;
        result.sum += value;
        ++result.count;
      }
    }
    return result;
  }

 private:
  std::span<const float> per_sample_;
  std::size_t columns_, rows_;
};

/// Probability that the cause of a refined pixel's variance continues in a neighbor whose pilot missed it.
constexpr double neighbor_share = 1.0 / 16;

/// Variance of a refined pixel: its own estimate has few degrees of freedom, so it is averaged with its neighbors and
/// the prediction, each converted to one sample.
float averaged_variance(const PixelState& pixel, double own, double predicted,
                        const Neighborhood::Neighbors& neighbors) {
  constexpr double own_weight = 4;  // the neighbors include the pixel itself
  const double sum = (own_weight - 1) * own + neighbors.sum + predicted;
  const double of_one = std::max(0.0, sum) / (own_weight + neighbors.count);
  return static_cast<float>(std::max(of_one / variance_of_one(1, pixel.count()), pixel.undetected()));
}

/// Squared errors of randomly selected pixels that represent more pixels.
struct HoldoutError {
  SummedErrors sum;
  std::size_t count = 0;
  void add(double squared_error) {
    sum.add(squared_error);
    ++count;
  }
  /// Extrapolates to `pixels`. Precondition: `count` > 0.
  [[nodiscard]] SummedErrors of(std::size_t pixels) const {
    const double each = static_cast<double>(pixels) / static_cast<double>(count);
    return {sum.squared * each, sum.spread * each * each};
  }
};

/// Update of one round, block by block.
class VarianceUpdate {
 public:
  VarianceUpdate(std::span<PixelState> pixels, std::uint32_t width, const DisplayTransform& display,
                 const InParallel& in_parallel)
      : pixels_(pixels),
        display_(display),
        in_parallel_(in_parallel),
        blocks_(pixels.size(), width),
        of_one_(pixels.size()),
        neighborhood_(of_one_, width) {}

  SampledError run() {
    const auto add_block = [&](std::uint64_t block, HoldoutClasses& classes) {
      blocks_.each_pixel(block, [&](std::size_t place, std::size_t, std::size_t) {
        const PixelState& pixel = pixels_[place];
        if (!pixel.refined() && pixel.measured() && pixel.hidden == 0) classes.add(pixel);
      });
    };
    holdout_classes_ = sum_in_parallel<HoldoutClasses>(in_parallel_, blocks_.count(), add_block);
    std::vector<Part> parts(blocks_.count());
    in_parallel_(blocks_.count(), [&](std::uint64_t block) {
      blocks_.each_pixel(block, [&](std::size_t place, std::size_t, std::size_t) { measure(place, parts[block]); });
    });
    const SampledError error = sum_up(parts);
    in_parallel_(blocks_.count(), [&](std::uint64_t block) {
      blocks_.each_pixel(block, [&](std::size_t place, std::size_t x, std::size_t y) { update(place, x, y); });
    });
    return error;
  }

 private:
  struct Part {
    SummedErrors sums, pilots;
    std::size_t pilot_count = 0;
    std::vector<std::pair<std::size_t, double>> holdout;  ///< places and errors
  };

  void measure(std::size_t place, Part& part) {
    const PixelState& pixel = pixels_[place];
    of_one_[place] = std::numeric_limits<float>::quiet_NaN();
    if (pixel.refined()) {
      if (!pixel.measured()) {  // the deadline was over
        part.sums.add(pixel.variance);
        return;
      }
      const double error = refined_error(pixel, display_);
      of_one_[place] = static_cast<float>(variance_of_one(error, pixel.count()));
      // Pixels that are not sampled again are selected for low estimates: the averaged variance has no such bias.
      part.sums.add(pixel.grows ? std::max(error, pixel.undetected()) : pixel.variance);
    } else if (pixel.hidden > 0) {
      part.sums.add(std::max(double{pixel.variance}, pixel.undetected()));
    } else {
      part.pilots.add(pixel.variance);
      ++part.pilot_count;
      if (pixel.measured()) part.holdout.emplace_back(place, holdout_classes_.error(pixel, display_));
    }
  }

  SampledError sum_up(const std::vector<Part>& parts) {
    SummedErrors sums, pilots;
    std::size_t pilot_count = 0;
    HoldoutError holdout;
    for (const Part& part : parts) {
      sums.add(part.sums);
      pilots.add(part.pilots);
      pilot_count += part.pilot_count;
      for (const auto& [place, error] : part.holdout) {
        holdout_classes_.add_error(pixels_[place], error);
        holdout.add(error);
      }
    }
    any_holdout_ = holdout.count > 0;
    sums.add(any_holdout_ ? holdout.of(pilot_count) : pilots);
    return sums.estimated();
  }

  void update(std::size_t place, std::size_t x, std::size_t y) {
    PixelState& pixel = pixels_[place];
    if (!std::isnan(of_one_[place])) {
      pixel.variance =
          averaged_variance(pixel, of_one_[place], predicted_variance(pixel.contrast), neighborhood_.neighbors(x, y));
    } else if (any_holdout_) {
      const double continued = neighborhood_.neighbors(x, y).mean() * neighbor_share;
      pixel.variance = static_cast<float>(std::max({holdout_classes_.predicted(pixel), continued, pixel.undetected()}));
    }
  }

  std::span<PixelState> pixels_;
  const DisplayTransform& display_;
  const InParallel& in_parallel_;
  Blocks blocks_;
  std::vector<float> of_one_;  ///< variance of one sample of a refined pixel, by itself; else NaN
  Neighborhood neighborhood_;
  HoldoutClasses holdout_classes_;
  bool any_holdout_ = false;
};

}  // namespace

WHITTLE_WIDE SummedErrors summed(std::span<const float> squared_errors) {
  double squared[lanes] = {}, spread[lanes] = {};
  const float* const errors = squared_errors.data();
  const std::size_t complete = squared_errors.size() / lanes * lanes;
  for (std::size_t first = 0; first < complete; first += lanes)
    for (int i = 0; i < lanes; ++i) {
      const double error = errors[first + static_cast<std::size_t>(i)];
      squared[i] += error;
      spread[i] += error * error;
    }
  SummedErrors sum;
  for (int i = 0; i < lanes; ++i) sum.add({squared[i], spread[i]});
  for (std::size_t i = complete; i < squared_errors.size(); ++i) sum.add(errors[i]);
  return sum;
}

SampledError SummedErrors::estimated() const {
  return {squared, std::max(0.0, squared + deviations * std::sqrt(spread))};
}

SampledError SummedErrors::validated() const {
  return {squared, std::max(0.0, squared + holdout_deviations * std::sqrt(spread))};
}

SampledError update_variances(std::span<PixelState> pixels, std::uint32_t width, const DisplayTransform& display,
                              const InParallel& in_parallel) {
  return VarianceUpdate(pixels, width, display, in_parallel).run();
}

SampledError upper_bound(const SampledError& own, const SampledError& holdout) {
  return {std::max(own.squared, holdout.squared), std::max(own.squared_upper, holdout.squared_upper)};
}

void OmittedError::add(double mean, double omitted_depth, double omitted_cutoff, const DisplayTransform& display) {
  const double code = display.level(mean);
  const auto squared = [&](double radiance) {
    const double difference = radiance > 0 ? display.level(mean + radiance) - code : 0;
    return difference * difference;
  };
  const double by_depth = squared(omitted_depth), by_cutoff = squared(omitted_cutoff);
  depth += by_depth;
  cutoff += by_cutoff;
  both += omitted_cutoff == 0 ? by_depth : omitted_depth == 0 ? by_cutoff : squared(omitted_depth + omitted_cutoff);
}

void OmittedError::add(const OmittedError& part) {
  depth += part.depth;
  cutoff += part.cutoff;
  both += part.both;
}

ErrorEstimate error_estimate(const SampledError& sampled, const OmittedError& omitted, std::size_t pixels) {
  const double channels = 3 * static_cast<double>(std::max<std::size_t>(1, pixels));
  ErrorEstimate error;
  error.confidence = confidence;
  error.sampling = std::sqrt(sampled.squared_upper / channels);
  error.depth = std::sqrt(omitted.depth / channels);
  error.cutoff = std::sqrt(omitted.cutoff / channels);
  error.estimate = std::sqrt((sampled.squared_upper + omitted.both) / channels);
  return error;
}

void add_approximation(ErrorEstimate& error, const SampledError& exact, std::size_t pixels) {
  const double channels = 3 * static_cast<double>(std::max<std::size_t>(1, pixels));
  const double total = exact.squared_upper / channels;
  const double estimated = error.estimate * error.estimate;
  error.approximation = std::sqrt(std::max(0.0, total - error.sampling * error.sampling));
  error.estimate = std::sqrt(std::max(estimated, total - error.sampling * error.sampling + estimated));
}

}  // namespace tracer
