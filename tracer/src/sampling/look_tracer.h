#pragma once
/// Traces looks: fresh samples of randomly drawn pixels, compared with the image. Exact ones also measure the error of
/// approximations.

#include <functional>
#include <optional>

#include "tracer/src/integrators/tracer_concept.h"
#include "tracer/src/parallel/parallel_for.h"
#include "tracer/src/sampling/camera_samples.h"
#include "tracer/src/sampling/looks.h"
#include "tracer/src/sampling/tiles.h"

namespace tracer {

template <Tracer T>
class LookTracer {
 public:
  /// References must outlive it.
  LookTracer(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control, TracerPool<T>& pool)
      : scene_(scene), settings_(settings), control_(control), tiles_(scene.image.window()), pool_(pool) {}

  /// Squared error of the image at each look, in squared code values, summed over the channels; 0 where a half has no
  /// finite sample. `value`: the image's pixel at a place. Throws std::bad_alloc.
  std::vector<FreshError> squared_errors(std::span<const Look> looks, const std::function<Color(std::size_t)>& value,
                                         const DisplayTransform& display) {
    std::vector<std::vector<std::size_t>> of_tile(tiles_.count());
    for (std::size_t i = 0; i < looks.size(); ++i) of_tile[tiles_.index(tiles_.pixel(looks[i].place))].push_back(i);
    std::vector<FreshError> errors(looks.size());
    for_each_tile(tiles_.count(), settings_.threads, [&](std::uint64_t tile) {
      if (control_.cancelled() || of_tile[tile].empty()) return;
      typename TracerPool<T>::Lease tracer(pool_);
      Batch& batch = (*tracer).batch();
      batch.clear();
      batch.light_points = light_points;
      for (const std::size_t i : of_tile[tile]) push_look(batch, looks[i]);
      if (!(*tracer).trace()) return;
      std::size_t next = 0;
      for (const std::size_t i : of_tile[tile]) {
        const std::optional<Halves> halves = halves_at(*tracer, next);
        if (halves) errors[i] = fresh_error(value(looks[i].place), *halves, display);
        next += 2 * look_half;
      }
    });
    samples_ += 2 * look_half * looks.size();
    return errors;
  }

  /// Number of samples so far.
  [[nodiscard]] std::uint64_t samples() const { return samples_; }

 private:
  static constexpr std::uint32_t light_points = 2;
  static constexpr std::uint64_t first_stream = std::uint64_t{1} << 40;  ///< beyond the streams of the image

  void push_look(Batch& batch, const Look& look) const {
    const Pixel pixel = tiles_.pixel(look.place);
    for (std::uint32_t half = 0; half < 2; ++half)
      for (std::uint32_t index = 0; index < look_half; ++index) {
        Sample sample = fresh_sample(scene_, pixel.x, pixel.y, index, first_stream + 2 * look.index + half);
        sample.share = 0;  // point samples: the effect of filtering textures is an error that they measure
        push(batch, scene_, sample);
      }
  }

  /// Means of the finite samples from `first`; nothing if a half has none.
  static std::optional<Halves> halves_at(const T& tracer, std::size_t first) {
    Halves halves{};
    for (Color& half : halves) {
      std::uint32_t count = 0;
      for (const std::size_t last = first + look_half; first < last; ++first) {
        if (!finite(tracer.radiance()[first])) continue;  // counted by the tracer
        half += tracer.radiance()[first];
        ++count;
      }
      if (count == 0) return std::nullopt;
      half = half * (1.0 / count);
    }
    return halves;
  }

  const CompiledScene& scene_;
  const RenderSettings& settings_;
  RenderControl& control_;
  Tiles tiles_;
  TracerPool<T>& pool_;
  std::uint64_t samples_ = 0;
};

/// Adds the error of the scene's approximations to the estimate: the part of the error against exact samples that the
/// estimate does not explain yet. Pixels are drawn by the distance from their value to the ends of the interval of the
/// exact image, so that a shadow that is left out is found, however small it is.
template <Tracer T>
void estimate_approximation_error(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control,
                                  const DisplayTransform& display, Rendered& rendered) {
  if (!scene.accuracy.approximate.any()) return;
  const InParallel in_parallel = [&](std::uint64_t count, const std::function<void(std::uint64_t)>& work) {
    for_each_tile(count, settings.threads, work);
  };
  const std::vector<float>& rgb = rendered.image.rgb;
  const std::size_t pixels = rgb.size() / 3;
  const auto value = [&](std::size_t place) { return Color{rgb[3 * place], rgb[3 * place + 1], rgb[3 * place + 2]}; };
  const std::vector<RadianceInterval> intervals = T::bounds(scene, {}, in_parallel, control);
  std::vector<float> bounds(pixels, 1.0F);
  for (std::size_t i = 0; i < intervals.size(); ++i)
    bounds[i] = squared_distance_bound(intervals[i], value(i), display);
  const LookDraws draws = draw_looks(bounds, std::max<std::size_t>(2048, pixels / 32), 0, scene.accuracy.seed);
  TracerPool<T> pool(scene, control, {});
  LookTracer<T> exact(scene, settings, control, pool);
  const std::vector<FreshError> errors = exact.squared_errors(draws.looks, value, display);
  SummedErrors sum;
  for (std::size_t i = 0; i < errors.size(); ++i)
    sum.add(errors[i].squared * draws.looks[i].weight / static_cast<double>(draws.looks.size()));
  add(rendered.statistics, pool.statistics());
  rendered.statistics.holdout_samples += exact.samples();
  add_approximation(rendered.error, sum.estimated(), pixels);
  rendered.error.looks += draws.looks.size();
  rendered.error.target_met = targets_reached(rendered.error);
}

}  // namespace tracer
