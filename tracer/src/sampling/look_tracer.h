#pragma once
/// Traces looks: fresh samples of randomly drawn pixels, compared with the image, or with exact samples of the same
/// pixels, which measures the error of approximations.

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

#include "tracer/src/integrators/tracer.h"
#include "tracer/src/parallel/parallel_for.h"
#include "tracer/src/sampling/deadline.h"
#include "tracer/src/sampling/looks.h"
#include "tracer/src/sampling/part_round.h"
#include "tracer/src/sampling/tiles.h"

namespace tracer {

class LookTracer {
 public:
  /// `kind`: one of looks. References must outlive it.
  LookTracer(const PartContext& context, PartKind kind)
      : context_(context), kind_(kind), tiles_(context.scene.image.window()) {}

  /// The halves of each look, of `half` samples each; none where a half has no finite sample. Throws std::bad_alloc.
  std::vector<std::optional<Halves>> halves(std::span<const Look> looks, std::uint32_t half) {
    LookRound round(kind_, half, tiles_, looks);
    if (!trace_in_parts(round, context_)) {
      for_each_tile(round.count(), context_.settings.threads, [&](std::uint64_t unit) {
        if (context_.control.cancelled()) return;
        const auto tracer = context_.pool.lease();
        trace_looks(context_.scene, kind_, tiles_, round.looks(unit), half, *tracer, round.halves(unit));
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
  std::vector<double> squared_errors(std::span<const Look> looks, const std::function<Color(std::size_t)>& value,
                                     const DisplayTransform& display) {
    const std::vector<std::optional<Halves>> found = halves(looks, look_half);
    std::vector<double> errors(looks.size());
    for (std::size_t i = 0; i < looks.size(); ++i)
      if (found[i]) errors[i] = fresh_error(value(looks[i].place), *found[i], display);
    return errors;
  }

  /// Number of samples so far.
  [[nodiscard]] std::uint64_t samples() const { return samples_; }

 private:
  const PartContext context_;
  const PartKind kind_;
  const Tiles tiles_;
  std::uint64_t samples_ = 0;
};

/// Looks beside the samples of an image.
struct LookCounts {
  std::size_t looks = 0;
  RenderStatistics statistics;
  void count_in(Rendered& rendered) const {
    add(rendered.statistics, statistics);
    rendered.error.looks += looks;
  }
};

/// Error of the approximations of an image, and of fixed samples that filter textures: of its limit for many samples.
struct ApproximationError : LookCounts {
  SampledError error;
};

/// Measures approximations and filters by looks: the same samples with and without them, so that noise which both have
/// cancels.
class ApproximationLooks {
 public:
  /// `value`: the image's pixel at a place. References must outlive it.
  ApproximationLooks(const MakeTracer& make, const CompiledScene& scene, const RenderSettings& settings,
                     RenderControl& control, const DisplayTransform& display,
                     const std::function<Color(std::size_t)>& value)
      : scene_(scene),
        settings_(settings),
        control_(control),
        display_(display),
        value_(value),
        exact_pool_(make, scene, control, {}),
        pool_(make, scene, control, scene.accuracy.approximate),
        exact_({scene, settings, control, exact_pool_}, PartKind::exact_looks),
        approximate_({scene, settings, control, pool_}, PartKind::looks) {}

  /// Pixels are drawn by what one sample at each center shows, so that a shadow that is left out is found if it covers
  /// one. Looks take about a tenth of the rays of `image` and of its patches, and the error includes what so few cannot
  /// exclude.
  /// Beyond that, adaptive samples go on while nothing else keeps the error above the target, or until a time budget is
  /// spent. Paths by diffuse surfaces are sampled until their noise in half of a look is twice the target error, if
  /// there is one; errors of patches alone are small and smooth, and get fewer looks of more samples.
  ApproximationError measure(const Deadline& deadline, const RenderStatistics& image) {
    const Accuracy& accuracy = scene_.accuracy;
    const bool paths = scene_.exact.needs.global_light;
    Approximations others = accuracy.approximate;
    others.interreflection = Approximations::Interreflection::exact;
    const bool patches = paths && accuracy.uses_patches() && !others.any();
    // An image of few samples goes without pairs, as if any pixel might have any radiance. A pair of paths shows noise.
    constexpr std::uint64_t pair_samples = 20;
    const bool by_pairs =
        !paths && (accuracy.adaptive || image.samples >= pair_samples * scene_.image.window().pixels());
    const std::vector<float> bounds = by_pairs ? pair_distances() : any_distances();
    const double target =
        accuracy.target().value_or(accuracy.tile_target().value_or(std::numeric_limits<double>::infinity()));
    const double squared_target = 3 * static_cast<double>(bounds.size()) * target * target;
    const std::size_t most = patches ? path_looks(bounds.size()) : std::max<std::size_t>(2048, bounds.size() / 32);
    std::uint32_t half = look_half;
    if (paths) half *= deadline.set() ? 8 : patches ? 32 : 2;  // a budget leaves no second try with more samples
    if (patches && !accuracy.adaptive)                         // so that there are enough looks
      half = static_cast<std::uint32_t>(
          std::clamp<std::size_t>(affordable(image, 1) / path_looks_min, look_half, std::size_t{half}));
    const Found none{.enough = patches    ? path_looks_min
                               : by_pairs ? most
                                          : std::numeric_limits<std::size_t>::max(),
                     .bound = std::accumulate(bounds.begin(), bounds.end(), 0.0)};
    constexpr std::size_t first_looks = 16;
    Found found = none;
    for (;;) {
      const std::size_t taken = found.squares.size();
      const SampledError error = found.error();
      const bool may_suffice = taken < path_looks_min || 2 * error.squared - error.squared_upper < squared_target;
      const bool goes_on = accuracy.adaptive && may_suffice && 4 * error.squared_upper > squared_target;
      std::size_t count = first_looks;
      if (!deadline.set()) {
        count = std::min(std::max(taken, first_looks), most - taken);
        if (!goes_on) count = std::min(count, affordable(image, half));
        if (taken > 8 * count) break;
      }
      if (!add(bounds, count, half, found) || deadline.spent() || control_.cancelled()) break;
      const double allowed = 4 * std::max(squared_target, found.squared()), noise = found.noise / found.count();
      if (!paths || deadline.set() || noise <= allowed || half == look_half_max) continue;
      if (found.squares.size() < path_looks_min) continue;
      half = std::min(std::bit_ceil(static_cast<std::uint32_t>(std::min(half * noise / allowed, 1e6))), look_half_max);
      found = none;
    }
    return measured(found.error());
  }

  /// The effect of filtered textures on fixed samples, at pixels drawn by `weights`. Looks take a small part of the
  /// image's samples: 1 in 64 or, for fewer than 64 looks, 1 in 8.
  ApproximationError measure_filters(std::span<const float> weights) {
    constexpr std::size_t few = 64, most = 2048;
    const std::uint32_t half = std::clamp(scene_.accuracy.samples / 2, look_half, look_half_max);
    // A look takes two halves, each with and without the filters.
    const std::size_t affordable = weights.size() * scene_.accuracy.samples / (std::size_t{4} * half);
    Found found;
    add(weights, std::clamp(affordable / 64, std::clamp<std::size_t>(affordable / 8, 1, few), most), half, found);
    return measured(found.error());
  }

 private:
  static constexpr double white_level = 255;
  /// Each look estimates sums over the image.
  struct Found {
    std::size_t enough = 0;         ///< looks that show the error; fewer add what they cannot exclude
    double bound = 0;               ///< sum of the bounds of all pixels
    std::vector<double> squares{};  ///< squared errors
    double noise = 0;               ///< sum of the variances in half of each look

    [[nodiscard]] double squared() const { return std::accumulate(squares.begin(), squares.end(), 0.0) / count(); }
    [[nodiscard]] double count() const { return std::max(1.0, static_cast<double>(squares.size())); }
    [[nodiscard]] SampledError error() const {
      SummedErrors sum;
      for (const double square : squares) sum.add(square / count());
      sum.spread += sum.largest * sum.largest;  // a few looks do not show how much larger others are
      SampledError error = sum.estimated();
      if (squares.size() >= enough) return error;
      error.add_possible(unseen_error(squares.size(), bound, sum.squared, enough));
      error.squared_upper = std::min(error.squared_upper, bound);
      return error;
    }
  };

  /// Number of looks for a part of what is left of a tenth of the rays of the image and of its patches: they vary.
  [[nodiscard]] std::size_t affordable(const RenderStatistics& image, std::uint32_t half) const {
    const std::uint64_t samples = exact_.samples() + approximate_.samples();
    const auto spent = static_cast<double>(exact_pool_.statistics().rays.total() + pool_.statistics().rays.total() -
                                           pair_rays_),
               of_image = static_cast<double>(image.rays.total()),
               of_patches = static_cast<double>(scene_.objects.radiosity ? scene_.objects.radiosity->figures.rays : 0);
    // The first looks show the cost of others; until then they may need 16 times the rays of an image's sample.
    const double per_sample = samples > 0
                                  ? 1.5 * spent / static_cast<double>(samples)
                                  : 16 * of_image / static_cast<double>(std::max<std::uint64_t>(image.samples, 1));
    const double left = 0.1 * (of_image + of_patches) - spent;
    return static_cast<std::size_t>(std::max(0.0, left) / std::max(4 * half * per_sample, 1.0));
  }

  /// Bounds of the squared error of each pixel, if the exact one may have any radiance.
  [[nodiscard]] std::vector<float> any_distances() const {
    std::vector<float> bounds(scene_.image.window().pixels());
    for (std::size_t i = 0; i < bounds.size(); ++i)
      for (const double channel : {value_(i).r, value_(i).g, value_(i).b}) {
        const double level = display_.level(channel), distance = std::max(level, white_level - level);
        bounds[i] += static_cast<float>(distance * distance);
      }
    return bounds;
  }

  /// Squared distances of an exact and an approximate sample at the center of each pixel. Where they agree, smaller
  /// things may still differ: by as much as a change of all of the pixel by four levels, it is assumed.
  [[nodiscard]] std::vector<float> pair_distances() {
    constexpr float unseen = 3 * 4 * 4;
    const Tiles tiles(scene_.image.window());
    std::vector<float> distances(scene_.image.window().pixels(), unseen);
    for_each_tile(tiles.count(), settings_.threads, [&](std::uint64_t tile) {
      if (control_.cancelled()) return;
      const std::vector<Pixel> pixels = tiles.pixels(tile);
      const auto exact = exact_pool_.lease(), approximate = pool_.lease();
      for (Tracer* const tracer : {&*exact, &*approximate}) {
        tracer->batch().clear();
        for (const Pixel& pixel : pixels) push(tracer->batch(), scene_, uniform_sample(scene_, pixel.x, pixel.y, 0, 1));
        if (!tracer->trace()) return;
      }
      for (std::size_t i = 0; i < pixels.size(); ++i) {
        const Color &a = (*exact).radiance()[i], &b = (*approximate).radiance()[i];
        for (const auto& [first, second] : {std::pair(a.r, b.r), std::pair(a.g, b.g), std::pair(a.b, b.b)})
          if (const double distance = display_.level(first) - display_.level(second); std::isfinite(distance))
            distances[tiles.place(pixels[i])] += static_cast<float>(distance * distance);
      }
    });
    pair_rays_ = exact_pool_.statistics().rays.total() + pool_.statistics().rays.total();
    pairs_ = distances.size();
    return distances;
  }

  /// Adds `count` looks at pixels drawn by their bounds; false if no pixel has one.
  bool add(std::span<const float> bounds, std::size_t count, std::uint32_t half, Found& found) {
    std::vector<Look> looks = draw_looks(bounds, count, found.squares.size(), scene_.accuracy.seed);
    for (Look& look : looks) look.index += static_cast<std::uint32_t>(looks_);  // no samples of earlier looks
    looks_ += looks.size();
    const std::vector<std::optional<Halves>> exact = exact_.halves(looks, half),
                                             approximate = approximate_.halves(looks, half);
    for (std::size_t i = 0; i < looks.size(); ++i) {
      found.squares.push_back(0);
      if (!exact[i] || !approximate[i]) continue;
      const HalvesDistance distance(value_(looks[i].place), *exact[i], *approximate[i], display_);
      found.squares.back() = distance.squared * looks[i].weight;
      found.noise += distance.noise * looks[i].weight;
    }
    return !looks.empty();
  }

  [[nodiscard]] ApproximationError measured(const SampledError& error) const {
    ApproximationError measured{{looks_, exact_pool_.statistics()}, error};
    tracer::add(measured.statistics, pool_.statistics());
    measured.statistics.holdout_samples += exact_.samples() + approximate_.samples() + 2 * pairs_;
    return measured;
  }

  const CompiledScene& scene_;
  const RenderSettings& settings_;
  RenderControl& control_;
  const DisplayTransform& display_;
  const std::function<Color(std::size_t)>& value_;
  TracerPool<> exact_pool_, pool_;
  LookTracer exact_, approximate_;
  std::size_t looks_ = 0;
  std::uint64_t pairs_ = 0, pair_rays_ = 0;
};

}  // namespace tracer
