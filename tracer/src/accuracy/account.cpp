#include "tracer/src/accuracy/account.h"

#include <algorithm>
#include <cmath>

#include "tracer/src/accuracy/contrast.h"
#include "tracer/src/math/vec.h"

namespace tracer {
namespace {

/// One-sided 95 % of a normal distribution is 1.645 of its deviations. The truth is a sum of squares by chance as much
/// as its estimate is, and independent of it, which makes 2.33 of the estimate's own; the rest is for sums of squares
/// leaning to the right.
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
  /// Call with every pixel that was added, once all are.
  double error(const PixelState& pixel, const Levels& levels) {
    Class& one = of(pixel.contrast);
    const double error = audited_error(pixel, levels, std::sqrt(std::max(0.0, one.radiance / one.count)));
    one.error += error;
    return error;
  }
  /// Of any pixel, then. With as much weight for what was expected as two audits have, so that a few do not tell tall
  /// tales.
  [[nodiscard]] double expected(const PixelState& pixel) {
    constexpr double prior_weight = 2;
    const Class& one = of(pixel.contrast);
    return std::max(0.0, (one.error + prior_weight * expected_variance(pixel.contrast)) / (one.count + prior_weight));
  }

 private:
  struct Class {
    double radiance = 0, error = 0, count = 0;
  };
  /// An octave of contrast each, from 2^-16 squared levels.
  Class& of(double contrast) {
    const int octave = contrast > 0 ? std::clamp(std::ilogb(contrast) + 17, 1, 40) : 0;
    return classes_[static_cast<std::size_t>(octave)];
  }
  std::array<Class, 41> classes_{};
};

/// Mean of `per_sample` over the pixel and its neighbours, where it was measured; negative: nowhere.
class Neighbourhood {
 public:
  Neighbourhood(std::span<const float> per_sample, std::uint32_t width)
      : per_sample_(per_sample), columns_(width), rows_(static_cast<std::int64_t>(per_sample.size()) / width) {}

  struct Around {
    double sum = 0, count = 0;
    [[nodiscard]] double mean() const { return count > 0 ? sum / count : 0; }
  };
  [[nodiscard]] Around around(std::size_t index) const {
    const std::int64_t x = static_cast<std::int64_t>(index) % columns_, y = static_cast<std::int64_t>(index) / columns_;
    Around result;
    for (std::int64_t ny = std::max<std::int64_t>(0, y - 1); ny <= std::min(rows_ - 1, y + 1); ++ny) {
      for (std::int64_t nx = std::max<std::int64_t>(0, x - 1); nx <= std::min(columns_ - 1, x + 1); ++nx) {
        const float value = per_sample_[static_cast<std::size_t>(ny * columns_ + nx)];
        if (std::isnan(value)) continue;
        result.sum += value;
        ++result.count;
      }
    }
    return result;
  }

 private:
  std::span<const float> per_sample_;
  std::int64_t columns_, rows_;
};

/// What there is in a refined pixel may go on in one beside it, with this probability: a pilot that saw nothing of it
/// has not been there.
constexpr double seen_beside = 1.0 / 16;

/// A refined pixel's variance: its own estimate has few degrees of freedom, so its neighbours have a say in it, and
/// what was expected before; the sum of their estimates, each as of one sample.
float learned_variance(const PixelState& pixel, double own, double expected, const Neighbourhood::Around& around) {
  constexpr double own_weight = 4;  // the neighbours include the pixel itself
  const double sum = (own_weight - 1) * own + around.sum + expected;
  const double of_one = std::max(0.0, sum) / (own_weight + around.count);
  return static_cast<float>(std::max(of_one / variance_of_one(1, pixel.count()), pixel.unseen()));
}

}  // namespace

SampledError SummedErrors::known() const { return {squared, std::max(0.0, squared + deviations * std::sqrt(spread))}; }

SampledError SummedErrors::known_by_audit() const {
  return {squared, std::max(0.0, squared + audit_deviations * std::sqrt(spread))};
}

SummedErrors AuditedError::of(std::size_t pixels) const {
  if (count_ == 0) return {};
  const double each = static_cast<double>(pixels) / static_cast<double>(count_);
  return {sum_.squared * each, sum_.spread * each * each};
}

SampledError settle(std::span<PixelState> pixels, std::uint32_t width, const Levels& levels) {
  SummedErrors sums, pilots;
  std::size_t pilot_count = 0;
  AuditedError audited;
  Audits audits;
  std::vector<float> of_one(pixels.size(), std::numeric_limits<float>::quiet_NaN());
  for (const PixelState& pixel : pixels)
    if (!pixel.refined() && pixel.measured() && pixel.hidden == 0) audits.add(pixel);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const PixelState& pixel = pixels[i];
    if (pixel.refined()) {
      if (!pixel.measured()) {  // there was no time for what was planned
        sums.add(pixel.variance);
        continue;
      }
      const double error = refined_error(pixel, levels);
      of_one[i] = static_cast<float>(variance_of_one(error, pixel.count()));
      // A pixel that was left alone may have been for looking better than it is: its neighbours have a say.
      sums.add(pixel.grows ? std::max(error, pixel.unseen()) : pixel.variance);
      continue;
    }
    if (pixel.hidden > 0) {
      sums.add(std::max(double{pixel.variance}, pixel.unseen()));
      continue;
    }
    pilots.add(pixel.variance);
    ++pilot_count;
    if (pixel.measured()) audited.add(audits.error(pixel, levels));
  }
  sums.add(audited.count() > 0 ? audited.of(pilot_count) : pilots);
  const Neighbourhood neighbourhood(of_one, width);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    PixelState& pixel = pixels[i];
    if (!std::isnan(of_one[i])) {
      pixel.variance = learned_variance(pixel, of_one[i], expected_variance(pixel.contrast), neighbourhood.around(i));
    } else if (audited.count() > 0) {
      const double beside = neighbourhood.around(i).mean() * seen_beside;
      pixel.variance = static_cast<float>(std::max({audits.expected(pixel), beside, pixel.unseen()}));
    }
  }
  return sums.known();
}

SampledError joined(const SampledError& own, const SampledError& audit) {
  return {std::max(own.squared, audit.squared), std::max(own.squared_upper, audit.squared_upper)};
}

SampledError settle(std::span<const float> variances) {
  SummedErrors sums;
  for (const float variance : variances) sums.add(variance);
  return sums.known();
}

void MissingError::add(double mean, double missing_depth, double missing_cutoff, const Levels& levels) {
  const double seen = levels.level(mean);
  const auto squared = [&](double light) {
    const double apart = light > 0 ? levels.level(mean + light) - seen : 0;
    return apart * apart;
  };
  depth += squared(missing_depth);
  cutoff += squared(missing_cutoff);
  both += squared(missing_depth + missing_cutoff);
}

ErrorEstimate error_estimate(const SampledError& sampled, const MissingError& missing, std::size_t pixels) {
  const double channels = 3 * static_cast<double>(std::max<std::size_t>(1, pixels));
  ErrorEstimate error;
  error.confidence = confidence;
  error.sampling = std::sqrt(sampled.squared_upper / channels);
  error.depth = std::sqrt(missing.depth / channels);
  error.cutoff = std::sqrt(missing.cutoff / channels);
  error.estimate = std::sqrt((sampled.squared_upper + missing.both) / channels);
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
