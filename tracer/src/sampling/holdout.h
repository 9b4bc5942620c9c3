#pragma once
/// Validates an image with holdout samples: fresh samples of randomly selected pixels that are in no pixel's mean and
/// took part in no decision. Exact ones also measure the cost of approximations.

#include <algorithm>
#include <functional>
#include <limits>

#include "tracer/src/integrators/tracer_concept.h"
#include "tracer/src/parallel/parallel_for.h"
#include "tracer/src/sampling/camera_samples.h"
#include "tracer/src/sampling/error_estimate.h"
#include "tracer/src/sampling/sample_allocation.h"
#include "tracer/src/sampling/tiles.h"

namespace tracer {

struct HoldoutPlan {
  std::function<Color(std::size_t)> mean;  ///< the image's pixel at a place
  std::span<const HoldoutPixel> pixels;    ///< ascending
  std::uint64_t stream = 0;                ///< different streams are independent
  /// Predicted squared error of the pixel at a place; null: infinite.
  std::function<double(std::size_t)> predicted;
};

struct HoldoutResult {
  SampledError image;
  std::vector<double> errors;  ///< squared error of each holdout pixel; 0 where all samples were non-finite
};

template <Tracer T>
class HoldoutEstimator {
 public:
  HoldoutEstimator(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control,
                   TracerPool<T>& pool)
      : scene_(scene), settings_(settings), control_(control), tiles_(scene.image.window()), pool_(pool) {}

  /// Measures the error of the image; see pixel_state.h. Throws std::bad_alloc.
  HoldoutResult measure(const HoldoutPlan& plan, const DisplayTransform& display) {
    std::vector<std::vector<std::size_t>> of_tile(tiles_.count());
    for (std::size_t i = 0; i < plan.pixels.size(); ++i) {
      of_tile[tiles_.index(tiles_.pixel(plan.pixels[i].place))].push_back(i);
      samples_ += 2 * std::uint64_t{plan.pixels[i].half};
    }
    HoldoutResult result;
    result.errors.resize(plan.pixels.size());
    for_each_tile(tiles_.count(), settings_.threads, [&](std::uint64_t tile) {
      if (control_.cancelled() || of_tile[tile].empty()) return;
      typename TracerPool<T>::Lease tracer(pool_);
      measure_tile(of_tile[tile], *tracer, plan, display, result.errors);
    });
    SummedErrors sum;
    for (std::size_t i = 0; i < plan.pixels.size(); ++i) sum.add(result.errors[i] * plan.pixels[i].stands_for);
    result.image = sum.validated();
    return result;
  }

  /// Number of holdout samples so far.
  [[nodiscard]] std::uint64_t samples() const { return samples_; }

 private:
  static constexpr std::uint32_t light_points = 2;
  static constexpr std::uint64_t first_stream = std::uint64_t{1} << 40;  ///< beyond the streams of all rounds
  /// A distance above this multiple of the prediction shows that the prediction was wrong.
  static constexpr double surprise = 16;

  /// Measures the holdout pixels at `indices`, into their `errors`.
  void measure_tile(std::span<const std::size_t> indices, T& tracer, const HoldoutPlan& plan,
                    const DisplayTransform& display, std::vector<double>& errors) {
    Batch& batch = tracer.batch();
    batch.clear();
    batch.light_points = light_points;
    for (const std::size_t index : indices) push_pixel(batch, plan.pixels[index], plan.stream);
    if (!tracer.trace()) return;
    std::size_t next = 0;
    for (const std::size_t index : indices) {
      const HoldoutPixel& pixel = plan.pixels[index];
      PixelState state;
      state.pilot = plan.mean(pixel.place);
      for (std::size_t i = 0; i < 2 * std::size_t{pixel.half}; ++i, ++next) {
        const Color& radiance = tracer.radiance()[next];
        if (!finite(radiance)) continue;
        state.half[i / pixel.half] += radiance;
        ++state.half_count[i / pixel.half];
      }
      const double unlimited = std::numeric_limits<double>::infinity();
      if (state.measured())
        errors[index] = error_of(state, display, plan.predicted ? plan.predicted(pixel.place) : unlimited);
    }
  }

  /// The product of the halves is unbiased, but close to zero where few samples hit a missing feature, since both
  /// halves must hit it. If their mean is far from the prediction, the distance counts, which overestimates.
  static double error_of(const PixelState& state, const DisplayTransform& display, double predicted) {
    const double usual = std::sqrt(std::max(0.0, holdout_radiance_error(state)));
    const double error = holdout_error(state, display, usual), distance = squared_distance(state, display);
    return distance > surprise * predicted ? std::max(error, distance) : error;
  }

  void push_pixel(Batch& batch, const HoldoutPixel& holdout, std::uint64_t stream) const {
    const Pixel pixel = tiles_.pixel(holdout.place);
    for (std::uint32_t half = 0; half < 2; ++half)
      for (std::uint32_t index = 0; index < holdout.half; ++index)
        push(batch, scene_, sample(pixel, index, holdout.half, first_stream + 2 * stream + half));
  }

  /// Point samples, as all fresh samples. Pairs are mirrored, so that the slope of the image cancels.
  Sample sample(const Pixel& pixel, std::uint32_t index, std::uint32_t count, std::uint64_t stream) const {
    Sample sample = count == 2 ? mirrored_sample(scene_, pixel.x, pixel.y, index, stream)
                               : fresh_sample(scene_, pixel.x, pixel.y, index, stream);
    sample.share = 0;
    return sample;
  }

  const CompiledScene& scene_;
  const RenderSettings& settings_;
  RenderControl& control_;
  Tiles tiles_;
  TracerPool<T>& pool_;
  std::uint64_t samples_ = 0;
};

/// Adds the error of the scene's approximations to the estimate: the part of the error against exact holdout samples
/// that the estimate does not explain yet.
template <Tracer T>
void estimate_approximation_error(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control,
                                  const DisplayTransform& display, Rendered& rendered) {
  if (!scene.accuracy.approximate.any()) return;
  const std::vector<float>& rgb = rendered.image.rgb;
  const std::size_t pixels = rgb.size() / 3;
  const auto mean = [&](std::size_t place) { return Color{rgb[3 * place], rgb[3 * place + 1], rgb[3 * place + 2]}; };
  const auto count = static_cast<std::size_t>(full_holdout_budget(pixels).pixels);
  const std::vector<HoldoutPixel> holdout = select_holdout_pixels(pixels, count, 0, scene.accuracy.seed);
  TracerPool<T> pool(scene, control, {});
  HoldoutEstimator<T> exact(scene, settings, control, pool);
  const SampledError error =
      exact.measure({.mean = mean, .pixels = holdout, .stream = 0, .predicted = {}}, display).image;
  add(rendered.statistics, pool.statistics());
  rendered.statistics.holdout_samples += exact.samples();
  add_approximation(rendered.error, error, pixels);
  rendered.error.target_met = !rendered.error.target || rendered.error.estimate <= *rendered.error.target;
}

}  // namespace tracer
