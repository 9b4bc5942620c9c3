#include "tests/honesty/trial.h"

#include <algorithm>
#include <cmath>

namespace honesty {

using namespace tracer;

namespace {

/// Finaliser of MurmurHash3 (Appleby 2011).
std::uint64_t hashed(std::uint64_t x) {
  x = (x ^ (x >> 33)) * 0xff51afd7ed558ccdu;
  x = (x ^ (x >> 33)) * 0xc4ceb9fe1a85ec53u;
  return x ^ (x >> 33);
}

/// Of some channels: the sum of squared differences, the part of it that the reference brings, and how many.
struct Difference {
  double squares = 0, noise = 0;
  std::size_t channels = 0;
  void add(double difference, double variance) {
    squares += difference * difference;
    noise += variance;
    ++channels;
  }
  [[nodiscard]] double rmse() const {
    return channels == 0 ? 0 : std::sqrt(std::max(0.0, squares - noise) / static_cast<double>(channels));
  }
};

}  // namespace

double Trial::ratio() const {
  if (error.estimate > 0) return truth / error.estimate;
  return truth > 0 ? INFINITY : 1;
}

Rendered rendered_to(const Case& scene, double target, std::uint64_t seed, std::uint32_t threads) {
  Scene asked = scene.scene;
  asked.accuracy = {};
  asked.accuracy.adaptive.emplace().target_error = target;
  asked.accuracy.cutoff_by_chance = true;
  asked.accuracy.seed = seed;
  asked.output.layers = {Layer::error};
  return scenes::render(asked, threads, scene.assets);
}

Trial judged(const Case& scene, const Standard& standard, const Rendered& rendered, double target, std::uint64_t seed) {
  const Image& image = rendered.image;
  const Reference& reference = standard.reference;
  const LevelImage levels = levels_of(image_of(image), scene.scene.output);
  Difference whole;
  std::array<Difference, stratum_names.size()> parts;
  std::array<double, stratum_names.size()> claimed{};
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const auto stratum = static_cast<std::size_t>(standard.strata[i / 3]);
    whole.add(levels[i] - reference.levels[i], reference.variance[i]);
    parts[stratum].add(levels[i] - reference.levels[i], reference.variance[i]);
    const double error = image.layers.error.empty() ? 0 : image.layers.error[i / 3];
    claimed[stratum] += error * error;
  }
  Trial trial{target, seed, rendered.error, whole.rmse(), reference.error()};
  trial.samples_per_pixel =
      static_cast<double>(rendered.statistics.samples) / static_cast<double>(standard.strata.size());
  for (std::size_t s = 0; s < parts.size(); ++s)
    trial.strata[s] = {parts[s].channels / 3, parts[s].rmse(),
                       std::sqrt(claimed[s] / std::max<double>(1, static_cast<double>(parts[s].channels)))};
  return trial;
}

void seed_bias(Image& image, const Image& without_light, std::uint64_t seed) {
  for (std::size_t pixel = 0; pixel < image.rgb.size() / 3; ++pixel)
    if (hashed(pixel ^ hashed(seed)) % 100 == 0)
      std::copy_n(without_light.rgb.begin() + static_cast<std::ptrdiff_t>(3 * pixel), 3,
                  image.rgb.begin() + static_cast<std::ptrdiff_t>(3 * pixel));
}

Case without_light(const Case& scene) {
  Case dark = scene;
  dark.scene.lights.erase(dark.scene.lights.begin());
  return dark;
}

}  // namespace honesty
