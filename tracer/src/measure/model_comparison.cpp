#include "tracer/src/measure/model_comparison.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "tracer/src/math/vec.h"

namespace tracer {
namespace {

using Channels = std::array<double, 3>;

Color color_of(const Channels& channels) { return {channels[0], channels[1], channels[2]}; }
Channels channels_of(const Color& color) { return {color.r, color.g, color.b}; }

// ---- sources of light

/// Members of LightByCause that have a source in scenes.
struct Source {
  Color LightByCause::*cause;
  bool (*is_in)(const Scene& scene);
};

bool has_lights(const Scene& scene) { return !scene.lights.empty(); }

bool has_emission(const Scene& scene) {
  return std::ranges::any_of(scene.materials, [](const Material& material) {
    const auto* plain = std::get_if<Color>(&material.emission);
    return plain == nullptr || max_component(*plain) > 0;
  });
}

bool has_background(const Scene& scene) {
  const Background& background = scene.background;
  return background.gradient || background.environment || background.cube || max_component(background.color) > 0;
}

constexpr std::array sources{Source{&LightByCause::interreflection, has_lights},
                             Source{&LightByCause::emission, has_emission},
                             Source{&LightByCause::environment, has_background}};

/// The scene with light of this cause alone. The color of the depth cue is black: it is in both models.
Scene lit_by(const Scene& scene, Color LightByCause::*cause) {
  Scene alone = scene;
  if (cause != &LightByCause::interreflection) alone.lights.clear();
  if (cause != &LightByCause::environment) alone.background = {};
  if (cause != &LightByCause::emission)
    for (Material& material : alone.materials) material.emission = Color{};
  alone.ambient = cause == &LightByCause::ambient ? Color{1, 1, 1} : Color{};
  if (alone.depth_cue) alone.depth_cue->color = {};
  return alone;
}

/// Mean radiance of the pixels.
Color mean_light(const Image& image) {
  Channels sum{};
  for (std::size_t i = 0; i < image.rgb.size(); ++i) sum[i % 3] += image.rgb[i];
  return color_of(sum) * (3 / static_cast<double>(image.rgb.size()));
}

// ---- fitted ambient light

/// `image` with `change` times the ambient term more.
Image with_ambient(const Image& image, const Image& term, const Channels& change) {
  Image changed = image;
  for (std::size_t i = 0; i < changed.rgb.size(); ++i)
    changed.rgb[i] += static_cast<float>(change[i % 3] * term.rgb[i]);
  return changed;
}

/// Sums of the squared differences, by channel.
Channels squared_difference(const DisplayImage& one, const DisplayImage& other) {
  Channels sum{};
  for (std::size_t i = 0; i < one.codes.size(); ++i) {
    const double difference = double{one.codes[i]} - other.codes[i];
    sum[i % 3] += difference * difference;
  }
  return sum;
}

/// The ambient light that is closest to the truth by least squares of radiance, by channel, >= 0.
Channels linear_fit(const Image& without, const Image& term, const Image& truth) {
  Channels product{}, square{}, fit{};
  for (std::size_t i = 0; i < term.rgb.size(); ++i) {
    product[i % 3] += (double{truth.rgb[i]} - without.rgb[i]) * term.rgb[i];
    square[i % 3] += double{term.rgb[i]} * term.rgb[i];
  }
  for (std::size_t c = 0; c < 3; ++c) fit[c] = square[c] > 0 ? std::max(0.0, product[c] / square[c]) : 0;
  return fit;
}

/// The same by least squares of levels: golden-section search (Kiefer 1953), the channels at once, from 0 to a multiple
/// of the fit in radiance.
Channels fit_ambient(const Image& without, const Image& term, const Image& truth, const Output& output) {
  constexpr int steps = 20;       // to 1e-4 of the interval
  constexpr double multiple = 3;  // levels favor dark places, where the missing light is relatively larger
  constexpr double ratio = 1 / std::numbers::phi;
  const DisplayImage truth_display = to_display(truth, output);
  const auto error = [&](const Channels& ambient) {
    return squared_difference(to_display(with_ambient(without, term, ambient), output), truth_display);
  };
  Channels low{}, high = linear_fit(without, term, truth), left{}, right{};
  for (std::size_t c = 0; c < 3; ++c) {
    high[c] *= multiple;
    left[c] = high[c] * (1 - ratio);
    right[c] = high[c] * ratio;
  }
  Channels left_error = error(left), right_error = error(right);
  for (int step = 0; step < steps; ++step) {
    Channels next{};
    std::array<bool, 3> is_left{};
    for (std::size_t c = 0; c < 3; ++c) {
      is_left[c] = left_error[c] <= right_error[c];
      if (is_left[c]) {
        high[c] = std::exchange(right[c], left[c]);
        right_error[c] = left_error[c];
        next[c] = left[c] = high[c] - ratio * (high[c] - low[c]);
      } else {
        low[c] = std::exchange(left[c], right[c]);
        left_error[c] = right_error[c];
        next[c] = right[c] = low[c] + ratio * (high[c] - low[c]);
      }
    }
    const Channels next_error = error(next);
    for (std::size_t c = 0; c < 3; ++c) (is_left[c] ? left_error : right_error)[c] = next_error[c];
  }
  for (std::size_t c = 0; c < 3; ++c) low[c] = (low[c] + high[c]) / 2;
  return low;
}

}  // namespace

double distance(const DisplayImage& reference, double reference_error, const DisplayImage& image, double image_error) {
  return common_distance(reference, std::hypot(reference_error, image_error), image, image);
}

double common_distance(const DisplayImage& reference, double reference_error, const DisplayImage& one,
                       const DisplayImage& other) {
  double sum = 0;
  for (std::size_t i = 0; i < reference.codes.size(); ++i) {
    const double truth = reference.codes[i];
    sum += (one.codes[i] - truth) * (other.codes[i] - truth);
  }
  const double mean = sum / (static_cast<double>(reference.codes.size()) * codes_per_level * codes_per_level);
  return std::sqrt(std::max(0.0, mean - reference_error * reference_error));
}

Result<ModelComparison, Failure> compare_models(const Scene& scene, const Reference& whitted, const Reference& global,
                                                const RenderImage& render) {
  std::uint32_t image_number = std::max(whitted.images, global.images);
  const auto light = [&](Color LightByCause::*cause, const Reference& model) -> Result<Image, Failure> {
    Reference next = model;
    next.images = image_number++;
    return render(reference_scene(lit_by(scene, cause), next));
  };
  const auto term = light(&LightByCause::ambient, whitted);
  if (!term) return term.error();
  const Image whitted_image = mean_image(whitted), global_image = mean_image(global);
  const DisplayImage truth = to_display(global_image, scene.output);
  const double whitted_error = standard_error(whitted, scene.output);
  const double global_error = standard_error(global, scene.output);

  ModelComparison found;
  ModelError& error = found.error;
  const DisplayImage whitted_display = to_display(whitted_image, scene.output);
  error.levels = distance(truth, global_error, whitted_display, whitted_error);
  error.standard_error = std::hypot(whitted_error, global_error);
  double bias = 0;
  for (std::size_t i = 0; i < truth.codes.size(); ++i) bias += double{whitted_display.codes[i]} - truth.codes[i];
  error.bias = bias / (codes_per_level * static_cast<double>(truth.codes.size()));

  const Image without = with_ambient(whitted_image, *term, channels_of(scene.ambient * -1.0));
  const Channels fitted = fit_ambient(without, *term, global_image, scene.output);
  error.fitted_ambient = color_of(fitted);
  found.fitted = to_display(with_ambient(without, *term, fitted), scene.output);
  error.fitted_levels = distance(truth, global_error, found.fitted, whitted_error);

  error.by.ambient = Color{} + scene.ambient * mean_light(*term) * -1.0;
  const auto count = std::ranges::count_if(sources, [&](const Source& source) { return source.is_in(scene); });
  for (const Source& source : sources) {
    if (!source.is_in(scene)) continue;
    if (count == 1) {
      error.by.*source.cause = mean_light(global_image) + mean_light(without) * -1.0;
      continue;
    }
    const auto all = light(source.cause, global), local = light(source.cause, whitted);
    if (!all) return all.error();
    if (!local) return local.error();
    error.by.*source.cause = mean_light(*all) + mean_light(*local) * -1.0;
  }
  return found;
}

}  // namespace tracer
