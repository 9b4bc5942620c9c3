#pragma once
/// Traces looks: fresh samples of randomly drawn pixels, compared with the image. Exact ones also measure the error of
/// approximations.

#include <functional>

#include "tracer/src/integrators/tracer_concept.h"
#include "tracer/src/parallel/parallel_for.h"
#include "tracer/src/sampling/deadline.h"
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

/// Error of an image with approximations against exact samples of some of its pixels.
struct ApproximationError {
  SampledError exact;  ///< the whole error of the image
  std::size_t looks = 0;
  RenderStatistics statistics;
  void count_in(Rendered& rendered) const {
    add(rendered.statistics, statistics);
    rendered.error.looks += looks;
  }
};

/// Measures it, if the scene has approximations. Pixels are drawn by the distance from their value to the ends of the
/// interval of the exact image, so that a shadow that is left out is found, however small it is. With a time budget a
/// few looks are taken at a time, until it is spent. `value`: the image's pixel at a place.
template <Tracer T>
ApproximationError measure_approximation(const CompiledScene& scene, const RenderSettings& settings,
                                         RenderControl& control, const DisplayTransform& display,
                                         const std::function<Color(std::size_t)>& value, const Deadline& deadline) {
  if (!scene.accuracy.approximate.any()) return {};
  const InParallel in_parallel = [&](std::uint64_t count, const std::function<void(std::uint64_t)>& work) {
    for_each_tile(count, settings.threads, work);
  };
  const std::size_t pixels = scene.image.window().pixels();
  const std::vector<RadianceInterval> intervals = T::bounds(scene, {}, in_parallel, control);
  std::vector<float> bounds(pixels, 1.0F);
  for (std::size_t i = 0; i < intervals.size(); ++i)
    bounds[i] = squared_distance_bound(intervals[i], value(i), display);
  const std::size_t wanted = std::max<std::size_t>(2048, pixels / 32), at_once = deadline.set() ? 16 : wanted;
  TracerPool<T> pool(scene, control, {});
  LookTracer<T> exact({scene, settings, control, pool}, PartKind::exact_looks);
  std::vector<double> found;  // each is an estimate of the whole sum
  double bound = 0;
  do {
    const LookDraws draws = draw_looks(bounds, at_once, found.size() / at_once, scene.accuracy.seed);
    if (draws.looks.empty()) break;
    bound = draws.range;
    const std::vector<FreshError> errors = exact.squared_errors(draws.looks, value, display);
    for (std::size_t i = 0; i < errors.size(); ++i) found.push_back(errors[i].squared * draws.looks[i].weight);
  } while (found.size() < wanted && !deadline.spent() && !control.cancelled());
  SummedErrors sum;
  for (const double error : found) sum.add(error / static_cast<double>(found.size()));
  ApproximationError measured{sum.estimated(), found.size(), pool.statistics()};
  measured.exact.add_possible(unseen_error(found.size(), bound, sum.squared));
  measured.statistics.holdout_samples += exact.samples();
  return measured;
}

}  // namespace tracer
