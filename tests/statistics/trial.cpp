#include "tests/statistics/trial.h"

#include <algorithm>
#include <cmath>

namespace statistics {

using namespace tracer;

namespace {

/// Finaliser of MurmurHash3 (Appleby 2011).
std::uint64_t hashed(std::uint64_t x) {
  x = (x ^ (x >> 33)) * 0xff51afd7ed558ccdu;
  x = (x ^ (x >> 33)) * 0xc4ceb9fe1a85ec53u;
  return x ^ (x >> 33);
}

/// Squared differences over a number of channels, and the part of their sum that is due to the variance of the
/// reference.
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
  if (error.estimate > 0) return true_error / error.estimate;
  return true_error > 0 ? INFINITY : 1;
}

Rendered render_to_target(const Case& scene, double target, std::uint64_t seed, std::uint32_t threads) {
  Scene adaptive = scene.scene;
  adaptive.accuracy = {};
  adaptive.accuracy.adaptive.emplace().target_error = target;
  adaptive.accuracy.cutoff_by_chance = true;
  adaptive.accuracy.seed = seed;
  adaptive.output.layers = {Layer::error};
  return scenes::render(adaptive, threads, scene.assets);
}

Trial evaluate(const Case& scene, const GroundTruth& ground_truth, const Rendered& rendered, double target,
               std::uint64_t seed) {
  const Image& image = rendered.image;
  const ReferenceImage& reference = ground_truth.reference;
  const CodeValueImage values = code_values_of(image_of(image), scene.scene.output);
  Difference whole;
  std::array<Difference, pixel_class_names.size()> parts;
  std::array<double, pixel_class_names.size()> estimated{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto pixel_class = static_cast<std::size_t>(ground_truth.pixel_classes[i / 3]);
    whole.add(values[i] - reference.code_values[i], reference.variance[i]);
    parts[pixel_class].add(values[i] - reference.code_values[i], reference.variance[i]);
    const double error = image.layers.error.empty() ? 0 : image.layers.error[i / 3];
    estimated[pixel_class] += error * error;
  }
  Trial trial{target, seed, rendered.error, whole.rmse(), reference.error()};
  trial.samples_per_pixel =
      static_cast<double>(rendered.statistics.samples) / static_cast<double>(ground_truth.pixel_classes.size());
  for (std::size_t s = 0; s < parts.size(); ++s)
    trial.pixel_classes[s] = {parts[s].channels / 3, parts[s].rmse(),
                              std::sqrt(estimated[s] / std::max<double>(1, static_cast<double>(parts[s].channels)))};
  return trial;
}

void inject_bias(Image& image, const Image& without_light, std::uint64_t seed) {
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

}  // namespace statistics
