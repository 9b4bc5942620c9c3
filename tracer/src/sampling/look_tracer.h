#pragma once
/// Traces looks: fresh samples of randomly drawn pixels, compared with the image, or with exact samples of the same
/// pixels, which measures the error of approximations.

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

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

  /// The halves of each look, of `half` samples each; none where a half has no finite sample. Throws std::bad_alloc.
  std::vector<std::optional<Halves>> halves(std::span<const Look> looks, std::uint32_t half) {
    LookRound round(kind_, half, tiles_, looks);
    if (!trace_in_parts<T>(round, context_)) {
      for_each_tile(round.count(), context_.settings.threads, [&](std::uint64_t unit) {
        if (context_.control.cancelled()) return;
        typename TracerPool<T>::Lease tracer(context_.pool);
        trace_looks<T>(context_.scene, tiles_, round.looks(unit), half,
                       look_share(context_.scene, kind_ == PartKind::exact_looks), *tracer, round.halves(unit));
      });
    }
    samples_ += std::uint64_t{2} * half * looks.size();
    std::vector<std::optional<Halves>> found(looks.size());
    for (std::uint64_t unit = 0; unit < round.count(); ++unit)
      round.each(unit, [&](std::size_t look, const Halves& halves) { found[look] = halves; });
    return found;
  }

  /// Squared error of the image at each look, in squared code values, summed over the channels; 0 where a half has no
  /// finite sample. `value`: the image's pixel at a place. Throws std::bad_alloc.
  std::vector<FreshError> squared_errors(std::span<const Look> looks, const std::function<Color(std::size_t)>& value,
                                         const DisplayTransform& display) {
    const std::vector<std::optional<Halves>> found = halves(looks, look_half);
    std::vector<FreshError> errors(looks.size());
    for (std::size_t i = 0; i < looks.size(); ++i)
      if (found[i]) errors[i] = fresh_error(value(looks[i].place), *found[i], display);
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

/// Error of the approximations of an image, and of fixed samples that filter textures: of its limit for many samples.
struct ApproximationError {
  SampledError error;
  std::size_t looks = 0;
  RenderStatistics statistics;
  void count_in(Rendered& rendered) const {
    add(rendered.statistics, statistics);
    rendered.error.looks += looks;
  }
};

/// Measures approximations and filters by looks: the same samples with and without them, so that noise which both have
/// cancels.
template <Tracer T>
class ApproximationLooks {
 public:
  /// `value`: the image's pixel at a place. References must outlive it.
  ApproximationLooks(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control,
                     const DisplayTransform& display, const std::function<Color(std::size_t)>& value)
      : scene_(scene),
        settings_(settings),
        control_(control),
        display_(display),
        value_(value),
        exact_pool_(scene, control, {}),
        pool_(scene, control, scene.accuracy.approximate),
        exact_({scene, settings, control, exact_pool_}, PartKind::exact_looks),
        approximate_({scene, settings, control, pool_}, PartKind::looks) {}

  /// Pixels are drawn by the distance from their value to the ends of the interval of the exact image, so that a shadow
  /// that is left out is found, however small it is. Paths by diffuse surfaces are sampled until their noise in half of
  /// a look is twice the target error, if there is one, or the error of the approximations; errors of patches are
  /// small, and get fewer looks of more samples. With a time budget a few looks are taken at a time, until it is spent.
  ApproximationError measure(const Deadline& deadline) {
    const bool paths = scene_.exact.needs.global_light, patches = paths && scene_.accuracy.uses_patches();
    const double target = scene_.accuracy.target().value_or(std::numeric_limits<double>::infinity());
    const std::vector<float> bounds = bounds_by_intervals();
    const std::size_t wanted = patches ? path_looks(bounds.size()) : std::max<std::size_t>(2048, bounds.size() / 32);
    const std::size_t at_once = deadline.set() ? 16 : wanted;
    std::uint32_t half = look_half;
    if (paths) half *= deadline.set() ? 8 : patches ? 32 : 2;  // a budget leaves no second try with more samples
    Found found;
    for (std::uint64_t stream = 0;; ++stream) {
      if (!add(bounds, at_once, stream, half, found) || deadline.spent() || control_.cancelled()) break;
      if (found.squares.size() < wanted) continue;
      const double allowed = 4 * std::max(3 * static_cast<double>(bounds.size()) * target * target, found.squared());
      const double noise = found.noise / static_cast<double>(found.squares.size());
      if (!paths || deadline.set() || noise <= allowed || half == look_half_max) break;
      half = std::min(std::bit_ceil(static_cast<std::uint32_t>(std::min(half * noise / allowed, 1e6))), look_half_max);
      found = {};
    }
    return measured(found.error(wanted));
  }

  /// The effect of filtered textures on fixed samples, at pixels drawn by `weights`. Looks take a small part of the
  /// image's samples: 1 in 64 or, for fewer than 64 looks, 1 in 8.
  ApproximationError measure_filters(std::span<const float> weights) {
    constexpr std::size_t few = 64, most = 2048;
    const std::uint32_t half = std::clamp(scene_.accuracy.samples / 2, look_half, look_half_max);
    // A look takes two halves, each with and without the filters.
    const std::size_t affordable = weights.size() * scene_.accuracy.samples / (std::size_t{4} * half);
    Found found;
    add(weights, std::clamp(affordable / 64, std::clamp<std::size_t>(affordable / 8, 1, few), most), 0, half, found);
    return measured(found.error(0));
  }

 private:
  /// Each look estimates sums over the image.
  struct Found {
    std::vector<double> squares;  ///< squared errors
    double noise = 0;             ///< sum of the variances in half of each look
    double bound = 0;             ///< largest weighted bound of a look

    [[nodiscard]] double squared() const { return std::accumulate(squares.begin(), squares.end(), 0.0) / count(); }
    [[nodiscard]] double count() const { return std::max(1.0, static_cast<double>(squares.size())); }
    /// Fewer looks than wanted add what they cannot exclude.
    [[nodiscard]] SampledError error(std::size_t wanted) const {
      SummedErrors sum;
      for (const double square : squares) sum.add(square / count());
      sum.spread += sum.largest * sum.largest;  // a few looks do not show how much larger others are
      SampledError error = sum.estimated();
      if (squares.size() < wanted) error.add_possible(unseen_error(squares.size(), bound, sum.squared));
      return error;
    }
  };

  [[nodiscard]] std::vector<float> bounds_by_intervals() const {
    std::vector<float> bounds(scene_.image.window().pixels(), 1.0F);
    const InParallel in_parallel = [&](std::uint64_t count, const std::function<void(std::uint64_t)>& work) {
      for_each_tile(count, settings_.threads, work);
    };
    const std::vector<RadianceInterval> intervals = T::bounds(scene_, {}, in_parallel, control_);
    for (std::size_t i = 0; i < intervals.size(); ++i)
      bounds[i] = squared_distance_bound(intervals[i], value_(i), display_);
    return bounds;
  }

  /// Adds `count` looks at pixels drawn by their bounds; false if no pixel has one.
  bool add(std::span<const float> bounds, std::size_t count, std::uint64_t stream, std::uint32_t half, Found& found) {
    const LookDraws draws = draw_looks(bounds, count, stream, scene_.accuracy.seed);
    looks_ += draws.looks.size();
    const std::vector<std::optional<Halves>> exact = exact_.halves(draws.looks, half),
                                             approximate = approximate_.halves(draws.looks, half);
    found.bound = draws.range;
    for (std::size_t i = 0; i < draws.looks.size(); ++i) {
      found.squares.push_back(0);
      if (!exact[i] || !approximate[i]) continue;
      const HalvesDistance distance(value_(draws.looks[i].place), *exact[i], *approximate[i], display_);
      found.squares.back() = distance.squared * draws.looks[i].weight;
      found.noise += distance.noise * draws.looks[i].weight;
    }
    return !draws.looks.empty();
  }

  [[nodiscard]] ApproximationError measured(const SampledError& error) const {
    ApproximationError measured{.error = error, .looks = looks_, .statistics = exact_pool_.statistics()};
    tracer::add(measured.statistics, pool_.statistics());
    measured.statistics.holdout_samples += exact_.samples() + approximate_.samples();
    return measured;
  }

  const CompiledScene& scene_;
  const RenderSettings& settings_;
  RenderControl& control_;
  const DisplayTransform& display_;
  const std::function<Color(std::size_t)>& value_;
  TracerPool<T> exact_pool_, pool_;
  LookTracer<T> exact_, approximate_;
  std::size_t looks_ = 0;
};

}  // namespace tracer
