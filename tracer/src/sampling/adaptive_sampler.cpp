#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <mutex>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "tracer/src/parallel/parallel_for.h"
#include "tracer/src/sampling/brightest_pixel.h"
#include "tracer/src/sampling/deadline.h"
#include "tracer/src/sampling/error_estimate.h"
#include "tracer/src/sampling/film.h"
#include "tracer/src/sampling/image_error.h"
#include "tracer/src/sampling/look_tracer.h"
#include "tracer/src/sampling/part_round.h"
#include "tracer/src/sampling/pilot.h"
#include "tracer/src/sampling/refinement.h"
#include "tracer/src/sampling/sampler.h"
#include "tracer/src/sampling/subpixel_features.h"
#include "tracer/src/sampling/truncation.h"

namespace tracer {
namespace {

class AdaptiveSampler {
 public:
  AdaptiveSampler(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control,
                  const MakeTracer& make)
      : scene_(scene),
        control_(control),
        target_(*scene.accuracy.adaptive),
        tiles_(scene.image.window()),
        deadline_(settings, target_,
                  static_cast<std::uint32_t>(std::min<std::uint64_t>(concurrency(settings.threads), tiles_.count())),
                  scene.accuracy.approximate.any() ? approximation_share : 0,
                  scene.accuracy.proof ? 1 - proof_share : 1),
        decay_{.stratified = !scene.needs.lens && !has_random_rays(scene.needs)},
        film_(scene, scene.image.window(), decay_),
        preview_(settings.preview, tiles_, scene.image.window(), mean_),
        pilots_(scene, film_, tiles_, deadline_, preview_),
        pool_(make, scene, control, scene.accuracy.approximate),
        context_{scene, settings, control, pool_},
        refinement_(film_, tiles_, target_, decay_) {}

  Result<Rendered, Failure> run() {
    control_.begin(progress_parts);
    deadline_.reserve_time_to_write();
    trace_pilots();
    known_.pilots = pool_.statistics().samples;
    const ErrorContext context = error_context(scene_, film_.rgb());
    display_.emplace(context.display);
    known_.truncation = TruncationLooks(context_, mean_).measure(film_.omitted(), context);  // the same after rounds
    if (pilots_.complete() && !control_.cancelled()) {
      sample_thin_parts();
      find_brightest();
      refinement_.classify(features_.squared, *display_, in_parallel_);
      film_.forget_signatures();
      update_error();
      refine();
    } else if (!control_.cancelled()) {
      estimate_pilots();
    }
    const ApproximationError approximation = measure_approximation_error();
    if (control_.cancelled()) return Failure{Failure::Code::cancelled, "cancelled while tracing"};
    control_.reach(progress_parts);
    Rendered rendered = finish();
    approximation.count_in(rendered);
    known_.truncation.count_in(rendered);
    return rendered;
  }

 private:
  static constexpr std::uint64_t progress_parts = 1000;
  /// Fraction of a time budget for the error of approximations.
  static constexpr double approximation_share = 0.2;

  void trace_pilots() {
    const PreviewTiles::Open open(preview_);
    PilotRound round(film_, tiles_, pilots_, preview_);
    if (trace_in_parts(round, context_)) return;
    for (const std::uint32_t stride : pilot_strides(deadline_.set())) {
      // In a scattered order, so that tiles that are left out at the deadline are spread over the image.
      for_each_tile(tiles_.count(), context_.settings.threads, [&](std::uint64_t index) {
        if (control_.cancelled()) return;
        const auto tracer = pool_.lease();
        pilots_.trace(tiles_.scattered(index), stride, *tracer);
      });
      deadline_.measure_rate(pool_.statistics().samples);
      if (deadline_.over()) break;
    }
    if (!control_.cancelled()) pilots_.fill_tiles();
  }

  void sample_thin_parts() {
    const std::vector<SubpixelFeature> features = find_subpixel_features(scene_, 2 * film_.size() + 4096, true);
    if (features.empty()) return;
    // The classes of many features show their errors, without a sample of each.
    const bool few = features.size() < film_.size() / 8 + 64;
    const std::vector<Color> radiance =
        few ? sample_features(std::span(features), scene_, pool_, in_parallel_, [this] { return stopped(); })
            : std::vector<Color>(features.size(), unknown_radiance);
    features_ =
        features_of_pixels(features, radiance, {film_.rgb(), {}, film_.width()}, scene_.image.window(), *display_);
  }

  [[nodiscard]] bool stopped() const { return control_.cancelled() || deadline_.over(); }

  void refine() {
    while (!stopped() && refinement_.begin_round()) {
      bool any = false;
      const auto rays = [&] { return pool_.statistics().rays.total(); };
      const std::uint64_t before = rays();
      const double affordable = deadline_.affordable(before);
      while (!stopped()) {
        const auto step = refinement_.next_step(std::max(0.0, affordable - static_cast<double>(rays() - before)));
        if (!step) break;
        any = true;
        trace(*step);
      }
      if (!any) break;
      find_brightest();
      update_error();
      if (target_reached() || !refinement_.leaves_room()) break;
    }
  }

  void trace(const Refinement::Step& step) {
    const std::span<const PixelClass> classes = refinement_.classes();
    const TileMerger merger(film_, classes, step.plan, decay_, *display_);
    std::vector<SetsRound::Unit> units(step.last - step.first);
    in_parallel_(units.size(), [&](std::uint64_t i) {
      units[i].tile = tiles_.scattered(step.first + i);
      units[i].sets = plan_tile(scene_, film_, tiles_, units[i].tile, classes, step.plan);
    });
    std::vector<TileBook> books(units.size());
    trace_sets_of(units, [&](std::uint64_t unit, const SampleSets& sets, const SetSums& sums) {
      merger.merge(sets, sums, books[unit]);
    });
    TileBook all;
    for (const TileBook& book : books) all.add(book);
    refinement_.add(step, all);
  }

  /// Calls merge(index of the unit, sets, sums) for all sets; of a unit in order and under the lock of its tile.
  template <class Merge>
  void trace_sets_of(std::span<const SetsRound::Unit> units, const Merge& merge) {
    SetsRound round(scene_, units);
    const PreviewTiles::Open open(preview_);
    if (trace_in_parts(round, context_)) {
      for (std::uint64_t i = 0; i < units.size(); ++i) {
        PreviewTiles::Tile preview(preview_, units[i].tile);
        const std::lock_guard lock(preview);
        for (std::size_t set = 0; set < round.sums(i).size(); ++set) merge(i, units[i].sets[set], round.sums(i)[set]);
      }
    } else {
      for_each_tile(units.size(), context_.settings.threads, [&](std::uint64_t i) {
        if (control_.cancelled() || units[i].sets.empty()) return;
        const auto tracer = pool_.lease();
        PreviewTiles::Tile preview(preview_, units[i].tile);
        const auto stop = [&](std::size_t samples) {
          return control_.cancelled() || deadline_.over_before(static_cast<double>(samples));
        };
        trace_sets(scene_, tiles_, units[i].sets, *tracer, stop, [&](std::size_t index, const SetSums& sums) {
          const std::lock_guard lock(preview);
          merge(i, units[i].sets[index], sums);
        });
      });
    }
    deadline_.measure_rate(pool_.statistics().samples);
  }

  /// Samples the pixels that may be the brightest one, if levels depend on it: until it is roughly known, then until
  /// that is a small part of the error.
  void find_brightest() {
    constexpr double rough = 0.05;
    constexpr std::uint32_t first_round = 1u << 24;  // beyond those of the classes
    if (scene_.output.overflow != Output::Overflow::scale) return;
    if (!brightest_) brightest_.emplace(film_, features_.brightest, !decay_.stratified);
    for (std::uint32_t step = 0; step < BrightestPixels::steps_max && !stopped(); ++step) {
      double tolerance = rough;
      if (refinement_.classified()) {
        known_.tone = tone_error(film_.rgb(), scene_.output, brightest_->range(), in_parallel_);
        const double allowed = 0.1 * refinement_.wanted();
        if (known_.tone <= allowed) break;
        const BrightestRange range = brightest_->range();
        tolerance = std::min(rough, (range.high - range.low) / range.found * std::sqrt(allowed / known_.tone) / 2);
      }
      std::vector<SetsRound::Unit> units;
      std::map<std::uint64_t, std::size_t> unit_of_tile;
      for (const auto& [place, samples] : brightest_->next(tolerance, target_.samples_max)) {
        const std::uint64_t tile = tiles_.index(tiles_.pixel(place));
        const auto [unit, is_new] = unit_of_tile.emplace(tile, units.size());
        if (is_new) units.push_back({tile, {}});
        units[unit->second].sets.push_back({.place = static_cast<std::uint32_t>(place),
                                            .kind = SampleSets::Kind::measured,
                                            .samples = samples,
                                            .round = first_round + brightest_steps_});
      }
      if (units.empty()) break;
      const SetsPlan plan{.round = first_round + brightest_steps_++};
      const TileMerger merger(film_, refinement_.classes(), plan, decay_, *display_);
      std::vector<std::vector<std::pair<std::size_t, SetSums>>> found(units.size());
      std::vector<TileBook> books(units.size());
      trace_sets_of(units, [&](std::uint64_t unit, const SampleSets& sets, const SetSums& sums) {
        merger.merge(sets, sums, books[unit]);
        found[unit].emplace_back(sets.place, sums);
      });
      for (const TileBook& book : books) refinement_.add(book);
      for (const auto& of_unit : found)
        for (const auto& [place, sums] : of_unit) brightest_->add(place, sums);
      show();
    }
    known_.tone = tone_error(film_.rgb(), scene_.output, brightest_->range(), in_parallel_);
  }

  /// Shows the image with the brightest channel as it is known by now.
  void show() {
    const DisplayTransform before = *display_;
    display_.emplace(error_context(scene_, film_.rgb()).display);
    const double value = *std::ranges::max_element(film_.rgb()) / 4;  // clipped by neither
    if (!(before.level(value) > 0)) return;
    const double scale = std::pow(display_->level(value) / before.level(value), 2);
    film_.scale_errors(scale);
    refinement_.scale_errors(scale);
  }

  /// Estimates the error of an image of which pixels have no sample from looks alone, which may have missed whatever
  /// the scene contains.
  void estimate_pilots() {
    constexpr double count_min = 32, count_max = 2048;
    const double count = std::clamp(deadline_.holdout_samples() / (2 * look_half), count_min, count_max);
    const float brightest = rounded_up(radiance_bound(scene_).value_or(std::numeric_limits<double>::infinity()));
    const double level = display_->level(std::min(brightest, 1e30F));
    const std::vector<float> bounds(film_.size(), static_cast<float>(3 * level * level));
    const std::vector<Look> looks = draw_looks(bounds, static_cast<std::size_t>(count), 0, scene_.accuracy.seed);
    LookTracer tracer(context_, PartKind::looks);
    std::vector<double> errors = tracer.squared_errors(looks, mean_, *display_);
    for (std::size_t i = 0; i < errors.size(); ++i) errors[i] *= looks[i].weight;
    set_error(error_of_looks(errors, std::accumulate(bounds.begin(), bounds.end(), 0.0)), errors.size());
  }

  void update_error() {
    if (refinement_.classified()) set_error(sampled_error(), refinement_.looks());
  }

  [[nodiscard]] SampledError sampled_error() const {
    SampledError error = refinement_.error();
    if (decay_.stratified) return error;
    constexpr double chance_min = 0.5;  // with more edges than noise, no light is rare
    const UniformPixels pixels{film_.rgb(), film_.deviations(), film_.width()};
    const std::vector<float> all = refinement_.pixel_errors();
    const Blocks blocks(film_.size(), film_.width());
    const auto add_block = [&](std::uint64_t block, SummedErrors& sum) {
      std::vector<float> errors(all.begin() + static_cast<std::ptrdiff_t>(blocks.first_row(block) * pixels.width),
                                all.begin() + static_cast<std::ptrdiff_t>(blocks.first_row(block + 1) * pixels.width));
      sum.squared -= std::accumulate(errors.begin(), errors.end(), 0.0);
      sum.add(add_rare_light(pixels, *display_, blocks.first_row(block), errors, chance_min));
      sum.squared += std::accumulate(errors.begin(), errors.end(), 0.0);
    };
    const SummedErrors rare = sum_in_parallel<SummedErrors>(in_parallel_, blocks.count(), add_block);
    error.squared += rare.squared;
    error.squared_upper += rare.squared + error_deviations * std::sqrt(rare.spread);
    return error;
  }

  void set_error(const SampledError& sampled, std::uint64_t looks) {
    const ErrorParts parts{sampled, known_.truncation.error, known_.tone, known_.approximation};
    known_.sampled = sampled.squared_upper;
    known_.fixed = parts.omitted.both + known_.approximation.squared_upper;
    refinement_.set_fixed(known_.fixed + known_.tone);
    error_ = error_estimate(parts, film_.size());
    error_.target = target_.target_error;
    error_.tile_target = target_.tile_error;
    error_.looks = looks;
    if (target_.tile_error) error_.worst_tile = worst_tile();
    known_.first = std::max(known_.first, error_.estimate);
    control_.reach(static_cast<std::uint64_t>(progress() * progress_parts));
  }

  /// Error of the worst tile in levels, with its share of what samples do not lower.
  [[nodiscard]] double worst_tile() const {
    const double channels = 3 * static_cast<double>(film_.size());
    if (!refinement_.classified()) return std::sqrt((known_.sampled + known_.fixed + known_.tone) / channels);
    return std::hypot(refinement_.tile_errors().worst(), std::sqrt((known_.fixed + known_.tone) / channels));
  }

  /// Fraction of the time budget, or of the way to the target error on a logarithmic scale.
  [[nodiscard]] double progress() const {
    if (deadline_.set()) return deadline_.fraction_elapsed();
    if (!target_.target_error || !(error_.estimate > *target_.target_error)) return 0;
    return std::log(known_.first / error_.estimate) / std::log(known_.first / *target_.target_error);
  }

  /// Measures the error of the approximations with the image so far. If samples can reach the target beside it, more of
  /// them are taken.
  ApproximationError measure_approximation_error() {
    if (!scene_.accuracy.approximate.any() || control_.cancelled()) return {};
    ApproximationError measured =
        ApproximationLooks(pool_.make(), scene_, context_.settings, control_, *display_, mean_)
            .measure(deadline_, pool_.statistics());
    known_.approximation = measured.error;
    if (!refinement_.classified()) {
      add_approximation(error_, known_.approximation, film_.size());
      return measured;
    }
    update_error();
    if ((target_.target_error || target_.tile_error) && !target_reached() && refinement_.leaves_room()) refine();
    return measured;
  }

  [[nodiscard]] bool target_reached() const {
    if (target_.target_error || target_.tile_error) return targets_reached(error_);
    return deadline_.set() && error_.estimate <= invisible_error;
  }

  [[nodiscard]] ErrorEstimate::Limit limit() const {
    using enum ErrorEstimate::Limit;
    const bool targets = target_.target_error || target_.tile_error;
    if (targets && targets_reached(error_)) return target;
    if (deadline_.set() && deadline_.over()) return time_budget;
    if (!targets && target_reached()) return invisible;
    if (!refinement_.leaves_room()) return fixed_parts;
    return deadline_.set() ? time_budget : samples_max;
  }

  Rendered finish() {
    Rendered rendered;
    rendered.statistics = pool_.statistics();
    error_.worst_tile = worst_tile();
    const std::vector<float> errors =
        refinement_.classified()
            ? refinement_.pixel_errors()
            : std::vector<float>(film_.size(), static_cast<float>(known_.sampled / static_cast<double>(film_.size())));
    film_.write(rendered, errors, known_.pilots, in_parallel_);
    known_.truncation.add_to(rendered.image.layers.error);
    rendered.error = error_;
    rendered.error.bounded = scene_.has_bounded_patches() && known_.truncation.bounded;
    rendered.error.target_met = targets_reached(error_);
    rendered.error.limit = limit();
    return rendered;
  }

  const CompiledScene& scene_;
  RenderControl& control_;
  const Adaptive& target_;
  Tiles tiles_;
  Deadline deadline_;
  const InParallel in_parallel_ = [this](auto n, const auto& work) {
    for_each_tile(n, context_.settings.threads, work);
  };
  const SampleDecay decay_;
  Film film_;
  const std::function<Color(std::size_t)> mean_ = [this](std::size_t place) { return film_.mean(place); };
  PreviewTiles preview_;
  Pilots pilots_;
  TracerPool<> pool_;
  const PartContext context_;
  Refinement refinement_;
  PixelFeatures features_;
  std::optional<BrightestPixels> brightest_;
  std::uint32_t brightest_steps_ = 0;
  std::optional<DisplayTransform> display_;
  struct {
    TruncationError truncation;
    SampledError approximation;
    double tone = 0, fixed = 0, sampled = 0;  ///< squared, over the image; the last is an upper bound
    double first = 0;                         ///< levels
    std::uint64_t pilots = 0;
  } known_;
  ErrorEstimate error_;
};

}  // namespace

Result<Rendered, Failure> sample_adaptively(const CompiledScene& scene, const RenderSettings& settings,
                                            RenderControl& control, const MakeTracer& make) {
  return AdaptiveSampler(scene, settings, control, make).run();
}

}  // namespace tracer
