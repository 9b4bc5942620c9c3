#include "tracer/src/sampling/error_estimate.h"

#include <algorithm>
#include <cmath>

#include "tracer/src/math/vec.h"
#include "tracer/src/math/wide.h"
#include "tracer/src/sampling/contrast.h"

namespace tracer {
namespace {

/// One-sided 95 % of a normal distribution is 1.645 of its deviations. The truth is a sum of squares by chance as much
/// as its estimate is, and independent of it, which makes 2.33 of the estimate's own. That sums of squares lean to the
/// right is left to the audit that has to confirm it.
constexpr double deviations = 2.33;
constexpr double audit_deviations = 1.645;
constexpr double confidence = 0.95;

/// What audits tell of the pixels that have only their pilot, by how much contrast these have.
class Audits {
 public:
  void add(const PixelState& pixel) {
    Class& one = of(pixel.contrast);
    one.radiance += audited_radiance_error(pixel);
    ++one.count;
  }
  /// Those of another part of the image.
  void add(const Audits& part) {
    for (std::size_t i = 0; i < classes_.size(); ++i) {
      classes_[i].radiance += part.classes_[i].radiance;
      classes_[i].count += part.classes_[i].count;
    }
  }
  /// Of a pixel that was added, once all are.
  [[nodiscard]] double error(const PixelState& pixel, const DisplayTransform& levels) const {
    const Class& one = classes_[index(pixel.contrast)];
    return audited_error(pixel, levels, std::sqrt(std::max(0.0, one.radiance / one.count)));
  }
  /// Call with the error of every pixel that was added, in the same order for the same sums.
  void learn(const PixelState& pixel, double error) { of(pixel.contrast).error += error; }
  /// Of any pixel, then. With as much weight for what was expected as two audits have, so that a few do not tell tall
  /// tales.
  [[nodiscard]] double expected(const PixelState& pixel) const {
    constexpr double prior_weight = 2;
    const Class& one = classes_[index(pixel.contrast)];
    return std::max(0.0, (one.error + prior_weight * expected_variance(pixel.contrast)) / (one.count + prior_weight));
  }

 private:
  struct Class {
    double radiance = 0, error = 0, count = 0;
  };
  /// An octave of contrast each, from 2^-16 squared levels.
  static std::size_t index(double contrast) {
    return contrast > 0 ? static_cast<std::size_t>(std::clamp(std::ilogb(contrast) + 17, 1, 40)) : 0;
  }
  Class& of(double contrast) { return classes_[index(contrast)]; }
  std::array<Class, 41> classes_{};
};

/// Mean of `per_sample` over the pixel and its neighbours, where it was measured; negative: nowhere.
class Neighborhood {
 public:
  Neighborhood(std::span<const float> per_sample, std::uint32_t width)
      : per_sample_(per_sample), columns_(width), rows_(per_sample.size() / width) {}

  struct Around {
    double sum = 0, count = 0;
    [[nodiscard]] double mean() const { return count > 0 ? sum / count : 0; }
  };
  [[nodiscard]] Around around(std::size_t x, std::size_t y) const {
    Around result;
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

/// What there is in a refined pixel may go on in one beside it, with this probability: a pilot that saw nothing of it
/// has not been there.
constexpr double seen_beside = 1.0 / 16;

/// A refined pixel's variance: its own estimate has few degrees of freedom, so its neighbours have a say in it, and
/// what was expected before; the sum of their estimates, each as of one sample.
float learned_variance(const PixelState& pixel, double own, double expected, const Neighborhood::Around& around) {
  constexpr double own_weight = 4;  // the neighbours include the pixel itself
  const double sum = (own_weight - 1) * own + around.sum + expected;
  const double of_one = std::max(0.0, sum) / (own_weight + around.count);
  return static_cast<float>(std::max(of_one / variance_of_one(1, pixel.count()), pixel.unseen()));
}

/// One round's account, block by block.
class VarianceUpdate {
 public:
  VarianceUpdate(std::span<PixelState> pixels, std::uint32_t width, const DisplayTransform& levels,
                 const InParallel& in_parallel)
      : pixels_(pixels),
        levels_(levels),
        in_parallel_(in_parallel),
        blocks_(pixels.size(), width),
        of_one_(pixels.size()),
        neighbourhood_(of_one_, width) {}

  SampledError update_variances() {
    std::vector<Audits> audits(blocks_.count());
    each_pixel([&](std::uint64_t block, const PixelState& pixel) {
      if (!pixel.refined() && pixel.measured() && pixel.hidden == 0) audits[block].add(pixel);
    });
    for (const Audits& part : audits) audits_.add(part);
    std::vector<Part> parts(blocks_.count());
    in_parallel_(blocks_.count(), [&](std::uint64_t block) {
      blocks_.each_pixel(block, [&](std::size_t place, std::size_t, std::size_t) { tell(place, parts[block]); });
    });
    const SampledError error = sum_up(parts);
    in_parallel_(blocks_.count(), [&](std::uint64_t block) {
      blocks_.each_pixel(block, [&](std::size_t place, std::size_t x, std::size_t y) { learn(place, x, y); });
    });
    return error;
  }

 private:
  /// What a block's pixels tell.
  struct Part {
    SummedErrors sums, pilots;
    std::size_t pilot_count = 0;
    std::vector<std::pair<std::size_t, double>> audited;  ///< places and errors
  };

  template <class Work>
  void each_pixel(const Work& work) {
    in_parallel_(blocks_.count(), [&](std::uint64_t block) {
      blocks_.each_pixel(block, [&](std::size_t place, std::size_t, std::size_t) { work(block, pixels_[place]); });
    });
  }

  void tell(std::size_t place, Part& part) {
    const PixelState& pixel = pixels_[place];
    of_one_[place] = std::numeric_limits<float>::quiet_NaN();
    if (pixel.refined()) {
      if (!pixel.measured()) {  // there was no time for what was planned
        part.sums.add(pixel.variance);
        return;
      }
      const double error = refined_error(pixel, levels_);
      of_one_[place] = static_cast<float>(variance_of_one(error, pixel.count()));
      // A pixel that was left alone may have been for looking better than it is: its neighbours have a say.
      part.sums.add(pixel.grows ? std::max(error, pixel.unseen()) : pixel.variance);
    } else if (pixel.hidden > 0) {
      part.sums.add(std::max(double{pixel.variance}, pixel.unseen()));
    } else {
      part.pilots.add(pixel.variance);
      ++part.pilot_count;
      if (pixel.measured()) part.audited.emplace_back(place, audits_.error(pixel, levels_));
    }
  }

  SampledError sum_up(const std::vector<Part>& parts) {
    SummedErrors sums, pilots;
    std::size_t pilot_count = 0;
    AuditedError audited;
    for (const Part& part : parts) {
      sums.add(part.sums);
      pilots.add(part.pilots);
      pilot_count += part.pilot_count;
      for (const auto& [place, error] : part.audited) {
        audits_.learn(pixels_[place], error);
        audited.add(error);
      }
    }
    any_audited_ = audited.count() > 0;
    sums.add(any_audited_ ? audited.of(pilot_count) : pilots);
    return sums.known();
  }

  void learn(std::size_t place, std::size_t x, std::size_t y) {
    PixelState& pixel = pixels_[place];
    if (!std::isnan(of_one_[place])) {
      pixel.variance =
          learned_variance(pixel, of_one_[place], expected_variance(pixel.contrast), neighbourhood_.around(x, y));
    } else if (any_audited_) {
      const double beside = neighbourhood_.around(x, y).mean() * seen_beside;
      pixel.variance = static_cast<float>(std::max({audits_.expected(pixel), beside, pixel.unseen()}));
    }
  }

  std::span<PixelState> pixels_;
  const DisplayTransform& levels_;
  const InParallel& in_parallel_;
  Blocks blocks_;
  std::vector<float> of_one_;  ///< a refined pixel's own variance of one sample; else not a number
  Neighborhood neighbourhood_;
  Audits audits_;
  bool any_audited_ = false;
};

}  // namespace

WHITTLE_WIDE SummedErrors summed(std::span<const float> squared_errors) {
  double squared[lanes] = {}, spread[lanes] = {};
  const float* const errors = squared_errors.data();
  const std::size_t whole = squared_errors.size() / lanes * lanes;
  for (std::size_t first = 0; first < whole; first += lanes)
    for (int i = 0; i < lanes; ++i) {
      const double error = errors[first + static_cast<std::size_t>(i)];
      squared[i] += error;
      spread[i] += error * error;
    }
  SummedErrors sum;
  for (int i = 0; i < lanes; ++i) sum.add({squared[i], spread[i]});
  for (std::size_t i = whole; i < squared_errors.size(); ++i) sum.add(errors[i]);
  return sum;
}

SampledError SummedErrors::known() const { return {squared, std::max(0.0, squared + deviations * std::sqrt(spread))}; }

SampledError SummedErrors::known_by_audit() const {
  return {squared, std::max(0.0, squared + audit_deviations * std::sqrt(spread))};
}

SummedErrors AuditedError::of(std::size_t pixels) const {
  if (count_ == 0) return {};
  const double each = static_cast<double>(pixels) / static_cast<double>(count_);
  return {sum_.squared * each, sum_.spread * each * each};
}

SampledError update_variances(std::span<PixelState> pixels, std::uint32_t width, const DisplayTransform& levels,
                              const InParallel& in_parallel) {
  return VarianceUpdate(pixels, width, levels, in_parallel).update_variances();
}

SampledError joined(const SampledError& own, const SampledError& audit) {
  return {std::max(own.squared, audit.squared), std::max(own.squared_upper, audit.squared_upper)};
}

void MissingError::add(double mean, double missing_depth, double missing_cutoff, const DisplayTransform& levels) {
  const double seen = levels.level(mean);
  const auto squared = [&](double light) {
    const double apart = light > 0 ? levels.level(mean + light) - seen : 0;
    return apart * apart;
  };
  const double by_depth = squared(missing_depth), by_cutoff = squared(missing_cutoff);
  depth += by_depth;
  cutoff += by_cutoff;
  both += missing_cutoff == 0 ? by_depth : missing_depth == 0 ? by_cutoff : squared(missing_depth + missing_cutoff);
}

void MissingError::add(const MissingError& part) {
  depth += part.depth;
  cutoff += part.cutoff;
  both += part.both;
}

ErrorEstimate error_estimate(const SampledError& sampled, const MissingError& omitted, std::size_t pixels) {
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
  const double whole = exact.squared_upper / channels;
  const double known = error.estimate * error.estimate;
  error.approximation = std::sqrt(std::max(0.0, whole - error.sampling * error.sampling));
  error.estimate = std::sqrt(std::max(known, whole - error.sampling * error.sampling + known));
}

}  // namespace tracer
