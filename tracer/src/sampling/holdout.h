#pragma once
/// The error of an image as fresh samples of some of its pixels tell it, chosen by chance: samples that are in no
/// pixel's mean and had no part in any decision. Exact ones tell what approximations cost, too.

#include <algorithm>
#include <functional>
#include <limits>

#include "tracer/src/parallel/parallel_for.h"
#include "tracer/src/sampling/camera_samples.h"
#include "tracer/src/sampling/error_estimate.h"
#include "tracer/src/sampling/holdout_selection.h"
#include "tracer/src/sampling/tiles.h"
#include "tracer/src/sampling/tracer_pool.h"

namespace tracer {

/// What is audited, and how.
struct HoldoutPlan {
  std::function<Color(std::size_t)> mean;  ///< of the image's pixel at a place
  std::span<const HoldoutPixel> choices;   ///< ascending
  std::uint64_t stream = 0;                ///< audits of different streams are independent
  /// The squared error that is expected of the pixel at a place; null: any is.
  std::function<double(std::size_t)> expected;
};

/// What an audit found.
struct HoldoutResult {
  SampledError image;
  std::vector<double> errors;  ///< squared, of each choice; 0 where its samples came to nothing
};

template <class Model>
class HoldoutEstimator {
 public:
  HoldoutEstimator(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control,
                   WavefrontPool<Model>& pool)
      : scene_(scene), settings_(settings), control_(control), tiles_(scene.image.window()), pool_(pool) {}

  /// Of the whole image; see pixel_state.h. Throws std::bad_alloc.
  HoldoutResult measure(const HoldoutPlan& plan, const DisplayTransform& levels) {
    std::vector<std::vector<std::size_t>> of_tile(tiles_.count());
    for (std::size_t i = 0; i < plan.choices.size(); ++i) {
      of_tile[tiles_.index(tiles_.pixel(plan.choices[i].place))].push_back(i);
      samples_ += 2 * std::uint64_t{plan.choices[i].half};
    }
    HoldoutResult found;
    found.errors.resize(plan.choices.size());
    for_each_tile(tiles_.count(), settings_.threads, [&](std::uint64_t tile) {
      if (control_.cancelled() || of_tile[tile].empty()) return;
      typename WavefrontPool<Model>::Lease wavefront(pool_);
      measure_tile(of_tile[tile], *wavefront, plan, levels, found.errors);
    });
    SummedErrors sum;
    for (std::size_t i = 0; i < plan.choices.size(); ++i) sum.add(found.errors[i] * plan.choices[i].stands_for);
    found.image = sum.known_by_audit();
    return found;
  }

  /// That all audits traced.
  [[nodiscard]] std::uint64_t samples() const { return samples_; }

 private:
  static constexpr std::uint32_t light_points = 2;
  static constexpr std::uint64_t streams = std::uint64_t{1} << 40;  ///< beyond those of all rounds

  /// Times what was expected of a pixel: that was wrong.
  static constexpr double caught = 16;

  /// Of the choices at `indices`, into their `errors`.
  void measure_tile(std::span<const std::size_t> indices, Wavefront<Model>& wavefront, const HoldoutPlan& plan,
                    const DisplayTransform& levels, std::vector<double>& errors) {
    Batch& batch = wavefront.batch();
    batch.clear();
    batch.light_points = light_points;
    for (const std::size_t index : indices) push_choice(batch, plan.choices[index], plan.stream);
    if (!wavefront.trace()) return;
    std::size_t next = 0;
    for (const std::size_t index : indices) {
      const HoldoutPixel& choice = plan.choices[index];
      PixelState state;
      state.pilot = plan.mean(choice.place);
      for (std::size_t i = 0; i < 2 * std::size_t{choice.half}; ++i, ++next) {
        const Color& radiance = wavefront.radiance()[next];
        if (!finite(radiance)) continue;
        state.half[i / choice.half] += radiance;
        ++state.half_count[i / choice.half];
      }
      if (state.measured())
        errors[index] = error_of(state, levels, plan.expected ? plan.expected(choice.place) : never);
    }
  }

  static constexpr double never = std::numeric_limits<double>::infinity();

  /// The halves' product is without bias, but where few samples meet what the pixel lacks it is seldom more than
  /// nothing: both halves must. Where one alone is far from what was expected, how far their mean is from the pixel
  /// counts, which errs on the side of too much.
  static double error_of(const PixelState& state, const DisplayTransform& levels, double expected) {
    const double usual = std::sqrt(std::max(0.0, audited_radiance_error(state)));
    const double error = audited_error(state, levels, usual), apart = squared_distance(state, levels);
    return apart > caught * expected ? std::max(error, apart) : error;
  }

  void push_choice(Batch& batch, const HoldoutPixel& choice, std::uint64_t stream) const {
    const Pixel pixel = tiles_.pixel(choice.place);
    for (std::uint32_t half = 0; half < 2; ++half)
      for (std::uint32_t index = 0; index < choice.half; ++index)
        push(batch, scene_, sample(pixel, index, choice.half, streams + 2 * stream + half));
  }

  /// Of their point alone, as all fresh samples are; pairs have nothing of the image's slope.
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
  WavefrontPool<Model>& pool_;
  std::uint64_t samples_ = 0;
};

/// Joins what exact samples tell to the estimate of an image whose approximations it did not know of: these are the
/// part that `sampling` and the rest do not explain.
template <class Model>
void account_for_approximations(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control,
                                const DisplayTransform& levels, Rendered& rendered) {
  if (!scene.accuracy.approximate.any()) return;
  const std::vector<float>& rgb = rendered.image.rgb;
  const std::size_t pixels = rgb.size() / 3;
  const auto mean = [&](std::size_t place) { return Color{rgb[3 * place], rgb[3 * place + 1], rgb[3 * place + 2]}; };
  const auto looks = static_cast<std::size_t>(thorough_audit(pixels).looks);
  const std::vector<HoldoutPixel> choices = choose_audits(pixels, looks, 0, scene.accuracy.seed);
  WavefrontPool<Model> pool(scene, control, {});
  HoldoutEstimator<Model> exact(scene, settings, control, pool);
  const SampledError whole =
      exact.measure({.mean = mean, .choices = choices, .stream = 0, .expected = {}}, levels).image;
  add(rendered.statistics, pool.statistics());
  rendered.statistics.holdout_samples += exact.samples();
  add_approximation(rendered.error, whole, pixels);
  rendered.error.met = !rendered.error.target || rendered.error.estimate <= *rendered.error.target;
}

}  // namespace tracer
