#include "tracer/src/sampling/proof.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "tracer/src/math/sampling.h"
#include "tracer/src/sampling/pixel_sums.h"

namespace tracer {
namespace {

/// Streams of samples that no other look has.
constexpr std::uint32_t first_index = 1u << 20;

}  // namespace

double squared_error_bound(const RadianceInterval& interval, const Color& value, const DisplayTransform& display) {
  constexpr float white = 1e30F;  // for every tone mapping
  double sum = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double level = display.level(value.*color_channels[c]), below = level - display.level(interval.low[c]),
                 above = display.level(std::min(interval.high[c], white)) - level;
    // The mean of the halves lies between them, and so its error is at most the larger one of theirs.
    const double range = interval.high[c] > display.white() || !std::isfinite(display.white()) ? 1.5 : 1;
    sum += range * std::pow(std::max(std::abs(below), std::abs(above)), 2);
  }
  return sum;
}

double squared_error(const Color& value, const Halves& fresh, const DisplayTransform& display) {
  double sum = 0;
  for (const auto channel : color_channels) {
    const double first = fresh[0].*channel, second = fresh[1].*channel, level = display.level(value.*channel);
    const auto distance = [&](double radiance) { return display.level(radiance) - level; };
    const double a = distance(first), b = distance(second), of_mean = distance((first + second) / 2);
    sum += std::max(a * b, 2 * of_mean * of_mean - (a * a + b * b) / 2);
  }
  return sum;
}

ErrorProof::ErrorProof(const CompiledScene& scene, const Image& image, const InParallel& in_parallel,
                       const RenderControl& control, const std::function<bool()>& hurry)
    : scene_(scene), image_(image), display_(scene.output, 0), sums_(image.rgb.size() / 3) {
  bound_pixels(scene, in_parallel, control, hurry, [&](std::size_t place, const RadianceInterval& interval) {
    sums_[place] = squared_error_bound(interval, value(place), display_);
  });
  std::partial_sum(sums_.begin(), sums_.end(), sums_.begin());
}

Color ErrorProof::value(std::size_t place) const {
  const float* const rgb = image_.rgb.data() + 3 * place;
  return {rgb[0], rgb[1], rgb[2]};
}

std::vector<Look> ErrorProof::draw(std::size_t count) const {
  std::vector<Look> looks;
  if (!(sums_.back() > 0)) return looks;
  const std::uint64_t key = mix(scene_.accuracy.seed ^ 0x70726f6f66);  // "proof"
  for (std::uint64_t number = sequence_.count(); looks.size() < count; ++number) {
    const double position = static_cast<double>(mix(key ^ mix(number)) >> 11) * 0x1p-53 * sums_.back();
    const auto place = std::ranges::upper_bound(sums_.begin(), sums_.end() - 1, position) - sums_.begin();
    looks.push_back({static_cast<std::uint32_t>(place), first_index + static_cast<std::uint32_t>(number)});
  }
  return looks;
}

void ErrorProof::add(std::span<const Look> looks, std::span<const std::optional<Halves>> halves) {
  for (std::size_t i = 0; i < looks.size(); ++i) {
    const std::size_t place = looks[i].place;
    const double bound = sums_[place] - (place > 0 ? sums_[place - 1] : 0);
    const double share = halves[i] ? squared_error(value(place), *halves[i], display_) / bound : 1;
    exceeded_ |= share > 1.01;
    sequence_.add(share);
  }
}

double ErrorProof::bound() const {
  if (exceeded_) return std::numeric_limits<double>::infinity();
  return std::sqrt(sequence_.upper_bound() * sums_.back() / (3 * static_cast<double>(sums_.size())));
}

}  // namespace tracer
