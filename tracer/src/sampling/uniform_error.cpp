#include "tracer/src/sampling/uniform_error.h"

#include "tracer/src/math/wide.h"

namespace tracer {
namespace {

WHITTLE_WIDE void predict_variances(const float* contrast, std::size_t count, std::uint32_t samples,
                                    float* __restrict variance) {
  for (std::size_t x = 0; x < count; ++x) variance[x] = static_cast<float>(predicted_variance(contrast[x]) / samples);
}

}  // namespace

UniformVariance::UniformVariance(const UniformPixels& pixels, const DisplayTransform& display)
    : pixels_(pixels),
      display_(display),
      contrasts_(pixels.width, pixels.rows(),
                 [this](std::size_t y, CodeValueRow& row) {
                   display_.show(pixels_.rgb.subspan(3 * y * pixels_.width, 3 * std::size_t{pixels_.width}), row);
                 }),
      variance_(pixels.width) {}

std::span<const float> UniformVariance::row(std::size_t y) {
  constexpr double prior_weight = 2;
  const std::span<const float> contrast = contrasts_.row(y);
  if (pixels_.variance.empty()) {
    predict_variances(contrast.data(), contrast.size(), pixels_.samples, variance_.data());
    return variance_;
  }
  const std::uint32_t others = pixels_.samples - 1;
  for (std::size_t x = 0; x < pixels_.width; ++x) {
    const double measured = sample_variance(y * pixels_.width + x), predicted = predicted_variance(contrast[x]);
    const double of_one = (measured * others + predicted * prior_weight) / (others + prior_weight);
    variance_[x] = static_cast<float>(of_one / pixels_.samples);
  }
  return variance_;
}

double UniformVariance::sample_variance(std::size_t pixel) const {
  double variance = 0;
  for (std::size_t i = 3 * pixel; i < 3 * pixel + 3; ++i) {
    if (pixels_.variance[i] == 0) continue;  // most of a background
    const double slope = display_.slope(pixels_.rgb[i]);
    variance += slope * slope * pixels_.variance[i];
  }
  return variance;
}

}  // namespace tracer
