#include "tracer/src/sampling/error_estimate.h"

#include <algorithm>
#include <cmath>

#include "tracer/src/math/lanes.h"
#include "tracer/src/math/vec.h"

namespace tracer {
namespace {

/// One-sided 95 % of a normal distribution is 1.645 deviations. The true error is a random sum of squares like its
/// estimate and independent of it, which makes that 2.33 deviations of the estimate.
constexpr double deviations = 2.33;
constexpr double confidence = 0.95;

/// Means of a value over the pixels of one octave of its prediction: they correct the prediction of all pixels of that
/// octave, so that no pixel's own value decides alone.
class OctaveMeans {
 public:
  void add(double predicted, double value) {
    Octave& octave = octaves_[index(predicted)];
    octave.sum += value;
    ++octave.count;
  }
  void add(const OctaveMeans& part) {
    for (std::size_t i = 0; i < octaves_.size(); ++i) {
      octaves_[i].sum += part.octaves_[i].sum;
      octaves_[i].count += part.octaves_[i].count;
    }
  }
  /// The mean of the octave; the prediction has the weight of two values, which damps small counts.
  [[nodiscard]] double corrected(double predicted) const { return corrected(predicted, 0, 0); }
  /// The same without one of its values.
  [[nodiscard]] double corrected_without(double predicted, double own) const { return corrected(predicted, own, 1); }

 private:
  struct Octave {
    double sum = 0, count = 0;
  };
  [[nodiscard]] double corrected(double predicted, double own, double own_count) const {
    constexpr double prior_weight = 2;
    const Octave& octave = octaves_[index(predicted)];
    const double sum = octave.sum - own + prior_weight * predicted;
    return std::max(0.0, sum / (octave.count - own_count + prior_weight));
  }
  /// From 2^-16 squared code values.
  static std::size_t index(double predicted) {
    return predicted > 0 ? static_cast<std::size_t>(std::clamp(std::ilogb(predicted), -16, 23) + 17) : 0;
  }
  std::array<Octave, 41> octaves_{};
};

/// Sums of a value over the neighbors of a pixel, without the pixel itself; NaN values are not measured.
class Neighborhood {
 public:
  Neighborhood(std::span<const float> values, std::uint32_t width)
      : values_(values), columns_(width), rows_(values.size() / width) {}

  struct Neighbors {
    double sum = 0, count = 0;
    [[nodiscard]] double mean() const { return count > 0 ? sum / count : 0; }
  };
  [[nodiscard]] Neighbors neighbors(std::size_t x, std::size_t y) const {
    Neighbors result;
    for (std::size_t ny = y - std::min<std::size_t>(y, 1); ny <= std::min(rows_ - 1, y + 1); ++ny) {
      for (std::size_t nx = x - std::min<std::size_t>(x, 1); nx <= std::min(columns_ - 1, x + 1); ++nx) {
        const float value = values_[ny * columns_ + nx];
        if (std::isnan(value) || (nx == x && ny == y)) continue;
        result.sum += value;
        ++result.count;
      }
    }
    return result;
  }

  [[nodiscard]] std::size_t columns() const { return columns_; }

 private:
  std::span<const float> values_;
  std::size_t columns_, rows_;
};

/// Probability that the cause of a refined pixel's variance continues in a neighbor whose pilot missed it.
constexpr double neighbor_share = 1.0 / 16;

/// Update after one round, block by block.
class VarianceUpdate {
 public:
  VarianceUpdate(const SampledPixels& pixels, const DisplayTransform& display, const InParallel& in_parallel)
      : pixels_(pixels.states),
        bounds_(pixels.bounds),
        display_(display),
        in_parallel_(in_parallel),
        blocks_(pixels.states.size(), pixels.width),
        of_one_(pixels.states.size()),
        suspicions_(pixels.states.size()),
        neighborhood_(of_one_, pixels.width) {}

  SampledParts run(std::span<const LookError> looks) {
    SampledParts parts = sum_of_blocks<SampledParts>(
        [&](std::size_t place, std::size_t, std::size_t, SampledParts& sum) { measure(place, sum); });
    const auto refined =
        sum_of_blocks<OctaveMeans>([&](std::size_t place, std::size_t x, std::size_t y, OctaveMeans& means) {
          if (!std::isnan(of_one_[place])) means.add(prediction(place, neighborhood_.neighbors(x, y)), of_one_[place]);
        });
    brightest_ = parts.brightest;
    const OctaveMeans pilots = means_of(looks);
    parts.add(sum_of_blocks<SampledParts>([&](std::size_t place, std::size_t x, std::size_t y, SampledParts& sum) {
      const Neighborhood::Neighbors neighbors = neighborhood_.neighbors(x, y);
      const double own = of_one_[place], predicted = prediction(place, neighbors);
      predict(place, std::isnan(own) ? pilots.corrected(predicted) : refined.corrected_without(predicted, own));
      pixels_[place].shown = shown(place, neighbors);
      if (!std::isnan(own)) suspect(place, neighbors, sum.suspected);
    }));
    raise_suspected(parts.suspected);
    for (const LookError& look : looks) predict_without_its_look(look, pilots);
    return parts;
  }

 private:
  static constexpr double quiet = 1e-3;  ///< variance relative to the bound of a pixel in which nothing was found

  /// Error that the samples of a refined pixel may have missed; none if they found something.
  struct Suspicion {
    enum Place : std::uint8_t { near_find, elsewhere, on_surface };
    float error = 0;
    Place place = near_find;
    bool found = false;
  };

  /// Sum over all pixels in a fixed order: work(place, x, y, sum).
  template <class Sum, class Work>
  Sum sum_of_blocks(const Work& work) {
    return sum_in_parallel<Sum>(in_parallel_, blocks_.count(), [&](std::uint64_t block, Sum& sum) {
      blocks_.each_pixel(block, [&](std::size_t place, std::size_t x, std::size_t y) { work(place, x, y, sum); });
    });
  }

  void measure(std::size_t place, SampledParts& sum) {
    const PixelState& pixel = pixels_[place];
    of_one_[place] = std::numeric_limits<float>::quiet_NaN();
    sum.brightest = std::max(sum.brightest, brightest_sample(pixel));
    if (pixel.refined() && pixel.measured()) {
      const double error = refined_error(pixel, display_), expected = expected_refined_error(pixel, display_);
      of_one_[place] = static_cast<float>(variance_of_one(error, pixel.count()));
      sum.refined.add(std::max(error, pixel.undetected()));
      sum.expected.add(expected);
      const double found = quiet * pixel.bound;  // the samples may differ even if the means of the halves do not
      suspicions_[place].found = of_one_[place] > found || variance_of_one(expected, pixel.count()) > found;
    } else if (pixel.refined()) {  // the deadline was over
      sum.refined.add(pixel.bound);
    } else if (pixel.certified) {
      sum.certified += pixel.bound;
    } else {
      sum.undetected += pixel.undetected();
    }
  }

  /// Predicts for each suspected pixel its part of the expected sum.
  void raise_suspected(const SuspectedErrors& all) {
    const double near_finds = all.share_near_finds(), elsewhere = all.elsewhere.share(1), alike = all.share_alike(),
                 on_surfaces = all.on_surfaces.share(1);
    const auto expected = [&](const Suspicion& own, double share) {
      if (own.found) return 0.0;
      if (own.place == Suspicion::near_find) return near_finds * own.error;
      if (own.place == Suspicion::on_surface) return on_surfaces * own.error;
      return elsewhere * own.error + alike * all.error_alike(own.error, share * share);
    };
    sum_of_blocks<SampledParts>([&](std::size_t place, std::size_t, std::size_t, SampledParts&) {
      if (std::isnan(of_one_[place])) return;
      PixelState& pixel = pixels_[place];
      const double error = expected(suspicions_[place], missed_share(pixel.count()));
      pixel.suspected = error > pixel.variance;
      if (pixel.suspected) pixel.variance = static_cast<float>(error);
    });
  }

  /// Adds a pixel to the suspected ones or to those with a find, and sets the error of its suspicion. Precondition: the
  /// pixel is refined and measured.
  void suspect(std::size_t place, const Neighborhood::Neighbors& neighbors, SuspectedErrors& sum) {
    const PixelState& pixel = pixels_[place];
    Suspicion& own = suspicions_[place];
    const double count = pixel.count(), share = missed_share(count);
    const bool alone = !(neighbors.sum > quiet * pixel.bound);
    if (own.found) {
      if (pixel.edge) add_find(pixel, alone, sum);
      return;
    }
    own.place = !pixel.edge ? Suspicion::on_surface : alone ? Suspicion::elsewhere : Suspicion::near_find;
    own.error = static_cast<float>(pixel.edge ? missed_edge_error(place, neighbors, alone, share)
                                              : pixel.bound / 3 * share * share);
    SuspectedErrors::Pixels& pixels = !pixel.edge ? sum.on_surfaces : alone ? sum.elsewhere : sum.near_finds;
    pixels.add({own.error, 1});
    if (own.place == Suspicion::elsewhere) sum.squared_shares += share * share;
  }

  void add_find(const PixelState& pixel, bool alone, SuspectedErrors& sum) const {
    const double hits = alone ? effective_hits(pixel) : 0;
    sum.missed_near_finds += 1 / (static_cast<double>(pixel.count()) + 1);
    sum.found_by_one += hits > 0.5 && hits < 1.5 ? 1 : 0;
    sum.found_by_two += hits >= 1.5 && hits < 2.5 ? 1 : 0;
    if (!alone) return;
    sum.squared_heights.add(squared_height(pixel, display_));
    ++sum.found_alone;
  }

  /// Error of a pixel with an edge whose samples have missed a part of `share`.
  [[nodiscard]] double missed_edge_error(std::size_t place, const Neighborhood::Neighbors& neighbors, bool alone,
                                         double share) const {
    const PixelState& pixel = pixels_[place];
    double error = pixel.bound * share * share;
    if (!bounds_.empty()) {
      RadianceInterval interval = bounds_[place];
      for (float& high : interval.high)  // a part of what was found is not brighter than that
        if (!alone || !std::isfinite(high)) high = std::min(high, film_value(brightest_));
      error = missed_error(pixel.mean(), interval, share, display_);
    }
    // An edge of height h at a random position has the variance h^2 / 6. Its neighbors have two or three pixels of it.
    constexpr double squared_heights = 3;
    return alone ? error : std::min(error, squared_heights * neighbors.sum * share * share);
  }

  /// A pixel's own estimate has few degrees of freedom: it is averaged with its neighbors and the prediction. What
  /// refined pixels found continues in neighbors that have only their pilot, as far as their bounds allow.
  [[nodiscard]] float shown(std::size_t place, const Neighborhood::Neighbors& neighbors) const {
    constexpr double own_weight = 3;
    const PixelState& pixel = pixels_[place];
    if (std::isnan(of_one_[place]))
      return std::max(pixel.variance, std::min(static_cast<float>(neighbors.mean()), pixel.bound) / 4);
    const double of_one = (own_weight * of_one_[place] + neighbors.sum) / (own_weight + neighbors.count);
    return std::max(pixel.variance, static_cast<float>(of_one / variance_of_one(1, pixel.count())));
  }

  [[nodiscard]] OctaveMeans means_of(std::span<const LookError> looks) const {
    OctaveMeans means;
    for (const LookError& look : looks)
      if (pixels_[look.place].open()) means.add(prediction(look.place), look.squared_error);
    return means;
  }

  void predict(std::size_t place, double of_one) {
    PixelState& pixel = pixels_[place];
    const double variance = std::isnan(of_one_[place]) ? of_one : of_one / variance_of_one(1, pixel.count());
    pixel.variance = static_cast<float>(std::max(std::min(variance, double{pixel.bound}), pixel.undetected()));
  }

  void predict_without_its_look(const LookError& look, const OctaveMeans& means) {
    if (pixels_[look.place].open())
      predict(look.place, means.corrected_without(prediction(look.place), look.squared_error));
  }

  [[nodiscard]] double prediction(std::size_t place) const {
    return prediction(place, neighborhood_.neighbors(place % neighborhood_.columns(), place / neighborhood_.columns()));
  }
  /// Variance of one sample of a pixel, from everything but its own fresh samples.
  [[nodiscard]] double prediction(std::size_t place, const Neighborhood::Neighbors& neighbors) const {
    const PixelState& pixel = pixels_[place];
    const double predicted = predicted_variance(pixel.contrast);
    if (pixel.refined()) return (neighbors.sum + predicted) / (neighbors.count + 1);
    return std::max(predicted, neighbors.mean() * neighbor_share);
  }

  std::span<PixelState> pixels_;
  std::span<const RadianceInterval> bounds_;
  double brightest_ = 0;
  const DisplayTransform& display_;
  const InParallel& in_parallel_;
  Blocks blocks_;
  std::vector<float> of_one_;  ///< variance of one sample of a refined pixel, by itself; else NaN
  std::vector<Suspicion> suspicions_;
  Neighborhood neighborhood_;
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

void SampledError::add_possible(double squared_error) {
  const double margin = std::hypot(squared_upper - squared, deviations * squared_error);
  squared += squared_error;
  squared_upper = squared + margin;
}

SampledError SummedErrors::estimated() const {
  return {squared, std::max(0.0, squared + deviations * std::sqrt(spread))};
}

SampledError SampledParts::estimated(const EstimatedSum& looks) const {
  // The halves of many pixels show how their errors compare with the expected ones; a few pixels of typical size count
  // as if they were as expected.
  constexpr double prior_pixels = 4;
  double refined_sum = refined.squared, spread = refined.spread, largest = refined.largest;
  if (expected.squared > 0) {
    const double prior = prior_pixels * expected.spread / expected.squared;
    const double ratio = (std::max(0.0, refined.squared) + prior) / (expected.squared + prior);
    refined_sum = std::max(refined_sum, ratio * expected.squared);
    spread = std::max(spread, 2 * ratio * ratio * expected.spread);
    largest = std::max(largest, ratio * expected.largest);
  }
  const EstimatedSum missed = suspected.expected();
  const double sum = refined_sum + certified_mean() + undetected + missed.squared + looks.squared;
  const double deviation = std::sqrt(spread + largest * largest + missed.variance + looks.variance);
  return {sum, std::max(0.0, sum + deviations * deviation)};
}

SampledParts update_variances(const SampledPixels& pixels, const DisplayTransform& display,
                              std::span<const LookError> looks, const InParallel& in_parallel) {
  return VarianceUpdate(pixels, display, in_parallel).run(looks);
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

void add_approximation(ErrorEstimate& error, const SampledError& approximation, std::size_t pixels) {
  const double channels = 3 * static_cast<double>(std::max<std::size_t>(1, pixels));
  error.approximation = std::sqrt(approximation.squared_upper / channels);
  error.approximation_min =
      std::sqrt(std::max(0.0, 2 * approximation.squared - approximation.squared_upper) / channels);
  for (double* const total : {&error.estimate, &error.worst_tile, &error.proven})
    *total = std::hypot(*total, error.approximation);
}

ErrorEstimate error_estimate(const ErrorParts& parts, std::size_t pixels) {
  const double channels = 3 * static_cast<double>(std::max<std::size_t>(1, pixels));
  const auto root = [&](double squared) { return std::sqrt(squared / channels); };
  ErrorEstimate error;
  error.confidence = confidence;
  error.sampling = root(std::min(parts.sampled.squared_upper, parts.proven));
  error.depth = root(parts.omitted.depth);
  error.cutoff = root(parts.omitted.cutoff);
  error.tone = root(parts.tone);
  const double fixed = parts.omitted.both + parts.tone;
  error.estimate = root(std::min(parts.sampled.squared_upper, parts.proven) + fixed);
  error.proven = root(parts.proven + fixed);
  add_approximation(error, parts.approximation, pixels);
  return error;
}

}  // namespace tracer
