#pragma once
/// Traces looks: fresh samples of randomly drawn pixels, compared with the image. Exact ones also measure the error of
/// approximations.

#include <functional>

#include "tracer/src/integrators/tracer_concept.h"
#include "tracer/src/parallel/parallel_for.h"
#include "tracer/src/sampling/looks.h"
#include "tracer/src/sampling/part_round.h"
#include "tracer/src/sampling/tiles.h"

namespace tracer {

template <Tracer T>
class LookTracer {
 public:
  /// `kind`: looks or exact_looks. References must outlive it.
  LookTracer(const PartContext<T>& context, PartKind kind)
      : context_(context), kind_(kind), tiles_(context.scene.image.window()) {}

  /// Squared error of the image at each look, in squared code values, summed over the channels; 0 where a half has no
  /// finite sample. `value`: the image's pixel at a place. Throws std::bad_alloc.
  std::vector<FreshError> squared_errors(std::span<const Look> looks, const std::function<Color(std::size_t)>& value,
                                         const DisplayTransform& display) {
    const std::uint32_t half = look_half_of(context_.scene, kind_ == PartKind::exact_looks);
    LookRound round(kind_, half, tiles_, looks);
    if (!trace_in_parts<T>(round, context_)) {
      for_each_tile(round.count(), context_.settings.threads, [&](std::uint64_t tile) {
        if (context_.control.cancelled()) return;
        typename TracerPool<T>::Lease tracer(context_.pool);
        trace_looks<T>(context_.scene, tiles_, round.looks(tile), half, *tracer, round.halves(tile));
      });
    }
    std::vector<FreshError> errors(looks.size());
    for_each_tile(round.count(), context_.settings.threads, [&](std::uint64_t tile) {
      round.each(tile, [&](std::size_t look, const Halves& halves) {
        errors[look] = fresh_error(value(looks[look].place), halves, display);
      });
    });
    samples_ += std::uint64_t{2} * half * looks.size();
    return errors;
  }

  /// Number of samples so far.
  [[nodiscard]] std::uint64_t samples() const { return samples_; }

 private:
  const PartContext<T> context_;
  const PartKind kind_;
  const Tiles tiles_;
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
  LookTracer<T> exact({scene, settings, control, pool}, PartKind::exact_looks);
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
