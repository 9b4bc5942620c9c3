#pragma once
/// Takes samples where they lower the error most, until the target error is reached or the time budget is used up. Each
/// round allocates samples by predictions, traces them and estimates the remaining error: of refined pixels from their
/// halves, of pilots from looks (sampling/pixel_state.h, sampling/looks.h).

#include <algorithm>
#include <cmath>
#include <limits>

#include "tracer/src/integrators/tracer_concept.h"
#include "tracer/src/parallel/parallel_for.h"
#include "tracer/src/sampling/deadline.h"
#include "tracer/src/sampling/error_goal.h"
#include "tracer/src/sampling/film.h"
#include "tracer/src/sampling/look_tracer.h"
#include "tracer/src/sampling/part_round.h"
#include "tracer/src/sampling/pilot.h"
#include "tracer/src/sampling/proven_error.h"
#include "tracer/src/sampling/round_tracer.h"
#include "tracer/src/sampling/sample_allocation.h"
#include "tracer/src/sampling/tiles.h"

namespace tracer {

/// `Looks` is LookPool except in tests of what a faulty one does to the estimate.
template <Tracer T, class Looks = LookPool>
class AdaptiveSampler {
 public:
  AdaptiveSampler(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control)
      : scene_(scene),
        control_(control),
        target_(*scene.accuracy.adaptive),
        deadline_(settings, target_, concurrency(settings.threads),
                  scene.accuracy.approximate.any() ? approximation_share : 0),
        tiles_(scene.image.window()),
        film_(scene, scene.image.window(), in_parallel_),
        goal_(target_, film_.size(), scene.needs.global_light ? ErrorGoal::rounds_of_paths : ErrorGoal::few_rounds),
        preview_(settings.preview, tiles_, scene.image.window(), mean_),
        pilots_(scene, film_, tiles_, deadline_, preview_),
        pool_(scene, control, scene.accuracy.approximate),
        context_{scene, settings, control, pool_},
        look_tracer_(context_, PartKind::looks) {}

  /// Throws std::bad_alloc.
  Result<Rendered, Failure> run() {
    control_.begin(progress_parts);
    deadline_.reserve_time_to_write();
    trace_pilots();
    if (pilots_.complete() && deadline_.leaves(round_overhead_ms_per_pixel * static_cast<double>(film_.size()))) {
      refine();
    } else if (!control_.cancelled()) {
      estimate_pilots();
    }
    const ApproximationError approximation = measure_approximation_error();
    if (control_.cancelled()) return Failure{Failure::Code::cancelled, "cancelled while tracing"};
    control_.reach(progress_parts);
    Rendered rendered = finish();
    approximation.count_in(rendered);
    return rendered;
  }

 private:
  static constexpr std::uint32_t rounds_max = 24;  // at eightfold growth each, far more than any pixel may grow
  static constexpr std::uint64_t progress_parts = 1000;
  /// Looks before the first round, which correct the predictions of pilots, and the part of all rays that looks may
  /// take beyond the least number.
  static constexpr std::size_t first_looks = 256;
  static constexpr double look_share = 0.05;
  /// Fraction of a time budget for the error of approximations.
  static constexpr double approximation_share = 0.2;
  /// 1.5 times the overhead of the first round; with less time left, the pilots are the image.
  static constexpr double round_overhead_ms_per_pixel = 150e-6;

  void trace_pilots() {
    if (trace_pilots_in_parts()) return;
    for (const std::uint32_t stride : pilot_strides(deadline_.set())) {
      each_tile([&](std::uint64_t tile, T& tracer) { pilots_.trace(tile, stride, tracer); });
      deadline_.measure_rate(pool_.statistics().samples);
      if (deadline_.over()) break;
    }
    if (!control_.cancelled()) pilots_.fill_tiles();
  }

  bool trace_pilots_in_parts() {
    const PreviewTiles::Open open(preview_);
    PilotRound<T> round(film_, tiles_, pilots_, preview_);
    return trace_in_parts<T>(round, context_);
  }

  void refine() {
    film_.begin(T::bounds(scene_, scene_.accuracy.approximate, in_parallel_, control_));
    set_costs();
    if (scene_.output.overflow == Output::Overflow::scale) find_brightest();
    film_.certify(goal_.certified());
    if (!control_.cancelled() && !deadline_.over()) find_features();
    deadline_.reserve_time_for([&] {
      film_.predict_variance(film_.display());
      if (deadline_.set()) update_estimate();
    });
    if (look(first_looks) == 0 && !deadline_.set()) update_estimate();
    refine_in_rounds();
    if (deadline_.set() && !control_.cancelled()) look(looks_wanted());
    bound_error();
  }

  /// Samples the pixels that may be the brightest until that channel is roughly known: levels depend on it.
  void find_brightest() {
    constexpr double any_tone = std::numeric_limits<double>::infinity();
    for (std::uint32_t round = 0; round < rounds_max && !control_.cancelled() && !deadline_.over(); ++round) {
      SampleAllocation allocation{.half = std::vector<std::uint32_t>(film_.size())};
      const double affordable = deadline_.affordable(pool_.statistics().rays.total()) / 2;
      film_.raise_brightest(any_tone, cost_, affordable, target_, allocation);
      if (allocation.empty) return;
      trace_round(allocation);
      update_estimate();  // Few samples may agree by chance; neighbors predict their noise.
    }
  }

  /// Measures the error of the approximations with the image so far. If samples can reach the target beside it, more of
  /// them are taken.
  ApproximationError measure_approximation_error() {
    if (!scene_.accuracy.approximate.any() || control_.cancelled()) return {};
    const DisplayTransform display = film_.display();
    ApproximationError measured = ApproximationLooks<T>(scene_, context_.settings, control_, display, mean_)
                                      .measure(deadline_, pool_.statistics());
    known_.approximation = measured.error;
    known_.fixed += known_.approximation.squared_upper;
    summarize();
    const bool refined = !film_.pixels().empty() && (target_.target_error || target_.tile_error);
    if (refined && !target_reached() && goal_.leaves_room(known_)) {
      refine_in_rounds();
      bound_error();
    }
    return measured;
  }

  void refine_in_rounds() {
    known_.rounds_before = round_;
    for (++round_; round_ <= rounds_max && !control_.cancelled() && !deadline_.over(); ++round_) {
      look_before_samples();
      const bool enough = round_ > 1 || target_.samples_min == 1;
      if (enough && target_reached() && !any_unsafe(film_.pixels(), goal_.bound_max())) {
        if (look(looks_wanted()) == 0) break;
        continue;
      }
      const AllocationGoal goal = allocation_goal();
      SampleAllocation allocation = allocate_samples(film_.pixels(), cost_, goal, target_);
      if (target_.tile_error)
        raise_in_tiles(film_.pixels(), film_.width(), film_.excess_tiles(*target_.tile_error), target_, allocation);
      film_.raise_brightest(goal_.tone_max(known_), cost_, goal.cost / 2, target_, allocation);
      if (allocation.empty) {
        if (look(looks_wanted()) == 0 && !later_round_helps()) break;
        continue;
      }
      looks_.begin_epoch();
      trace_round(allocation);
      deadline_.reserve_time_for([&] { update_estimate(); });
    }
  }

  /// Takes `count` looks or as many as there is time for. Returns their number.
  std::size_t look(std::size_t count) {
    const double affordable = deadline_.holdout_samples() / (2 * look_half);
    const LookDraws draws =
        looks_.draw(film_.pixels(), static_cast<std::size_t>(std::min(affordable, static_cast<double>(count))),
                    scene_.accuracy.seed);
    if (draws.looks.empty()) return 0;
    const DisplayTransform display = film_.display();
    const std::vector<FreshError> errors = [&] {
      const PreviewTiles::Open open(preview_);  // tiles are only read
      return look_tracer_.squared_errors(draws.looks, mean_, display);
    }();
    looks_.add(draws, errors);
    if (round_ == 0) {  // the first round refines the pixels that are found anyway
      update_estimate();
      return draws.looks.size();
    }
    estimate_with_looks();
    for (std::size_t i = 0; i < errors.size(); ++i) film_.raise_variance(draws.looks[i].place, errors[i].squared);
    return draws.looks.size();
  }

  /// True if a later round, with a lower goal, may still reach the target though this one needs no samples.
  [[nodiscard]] bool later_round_helps() const {
    const double left = known_.fixed + known_.tone;  // no pixel may lower the tone
    return !target_reached() && (target_.target_error ? left < goal_.squared() : deadline_.set());
  }

  /// Takes looks while they lower the estimate for less than samples do.
  void look_before_samples() {
    // Most of the estimate is what few looks cannot exclude.
    const auto mostly_unseen = [&] { return 2 * known_.unseen > known_.sampled.squared_upper; };
    const auto looks_are_few = [&] { return 2 * look_tracer_.samples() < pool_.statistics().samples; };
    while (deadline_.set() && mostly_unseen() && looks_are_few() && look(looks_min - looks_.count()) > 0) continue;
    if (round_ == 1) return;
    if (goal_.is_large(known_.unseen)) look(looks_min - looks_.count());
    while (goal_.is_large(known_.uncertain) && looks_are_few() && look(affordable_looks()) > 0) continue;
  }

  /// Number of further looks at an image whose estimate reaches the target: until that is proven.
  [[nodiscard]] std::size_t looks_wanted() const {
    return target_reached() && looks_.proven() <= goal_.proven() ? 0 : affordable_looks();
  }

  /// Number of further looks that cost only a part of the work so far.
  [[nodiscard]] std::size_t affordable_looks() const {
    const double affordable = look_share * static_cast<double>(pool_.statistics().samples) / (2 * look_half);
    const std::size_t most = std::max(looks_min, static_cast<std::size_t>(affordable)), count = looks_.count();
    return count < most - most / 8 ? std::min(most - count, std::max(count, first_looks)) : 0;
  }

  void set_costs() {
    cost_.resize(film_.size());
    for (std::uint64_t tile = 0; tile < tiles_.count(); ++tile)
      for (const Pixel& pixel : tiles_.pixels(tile)) cost_[tiles_.place(pixel)] = pilots_.cost(tile);
  }

  /// Estimates the error of an image without rounds from looks alone, which may have missed whatever the scene
  /// contains.
  void estimate_pilots() {
    constexpr double count_min = 32, count_max = 2048;
    const double count = std::clamp(deadline_.holdout_samples() / (2 * look_half), count_min, count_max);
    const DisplayTransform display = film_.display();
    const float brightest = rounded_up(radiance_bound(scene_).value_or(std::numeric_limits<double>::infinity()));
    const RadianceInterval any{.low = {}, .high = {brightest, brightest, brightest}};
    const std::vector<float> bounds(film_.size(), squared_error_bound(any, display));
    const LookDraws draws = draw_looks(bounds, static_cast<std::size_t>(count), 0, scene_.accuracy.seed);
    const std::vector<FreshError> errors = look_tracer_.squared_errors(draws.looks, mean_, display);
    SummedLooks sum;
    for (std::size_t i = 0; i < errors.size(); ++i) sum.add(errors[i].squared * draws.looks[i].weight);
    known_.sampled = SampledParts{}.estimated(sum.estimate(errors.size(), draws.range));
    measure_fixed_parts(display);
    summarize();
  }

  /// Samples features that are too small for the pilots, and adds what is visible to the film.
  void find_features() {
    const std::vector<SubpixelFeature> features = find_subpixel_features(scene_, 2 * film_.size() + 4096);
    const std::vector<Color> radiance = sample_features(std::span(features), scene_, pool_, in_parallel_,
                                                        [this] { return control_.cancelled() || deadline_.over(); });
    const DisplayTransform display = film_.display();
    for (std::size_t i = 0; i < features.size(); ++i)
      if (finite(radiance[i]))
        film_.add_feature(tiles_.place({features[i].x, features[i].y}), features[i], radiance[i], display);
  }

  void trace_round(const SampleAllocation& allocation) {
    if (may_divide(scene_, context_.settings)) {
      const PreviewTiles::Open open(preview_);
      AllocatedRound round(film_, tiles_, preview_, allocation.half);
      if (trace_in_parts<T>(round, context_)) return;
    }
    RoundTracer<T> round(scene_, control_, film_, tiles_, deadline_, preview_);
    each_tile([&](std::uint64_t tile, T& tracer) { round.trace(tile, allocation.half, tracer); });
    if (deadline_.set()) withdraw_without_samples(film_.pixels());  // for lack of time
    deadline_.measure_rate(pool_.statistics().samples);
  }

  void update_estimate() {
    const DisplayTransform display = film_.display();
    parts_ = update_variances({film_.pixels(), film_.width(), film_.bounds()}, display, looks_.errors(), in_parallel_);
    measure_fixed_parts(display);
    estimate_with_looks();
  }

  /// Measures what only samples of the image change.
  void measure_fixed_parts(const DisplayTransform& display) {
    known_.omitted = film_.omitted_error(display);
    known_.tone = film_.tone_error();
    known_.fixed = parts_.certified_mean() + known_.omitted.both + known_.approximation.squared_upper;
    if (target_.tile_error) known_.worst_tile = film_.tile_errors().worst();
  }

  void estimate_with_looks() {
    const EstimatedSum looks = looks_.estimate(film_.pixels());
    known_.sampled = parts_.estimated(looks);
    known_.unseen = looks.unseen;
    known_.uncertain =
        known_.sampled.squared_upper - parts_.estimated({.squared = looks.squared, .variance = 0}).squared_upper;
    summarize();
  }

  void summarize() {
    error_ = error_estimate({known_.sampled, known_.omitted, known_.tone, known_.approximation, known_.proven},
                            film_.size());
    if (scene_.accuracy.approximate.any()) error_.proven = std::numeric_limits<double>::infinity();
    error_.target = target_.target_error;
    error_.tile_target = target_.tile_error;
    error_.worst_tile = std::hypot(known_.worst_tile, std::sqrt((known_.fixed + known_.tone) / goal_.channels()));
    known_.first = std::max(known_.first, error_.estimate);
    control_.reach(static_cast<std::uint64_t>(progress() * progress_parts));
  }

  /// Fraction of the time budget, or of the way to the target error on a logarithmic scale.
  [[nodiscard]] double progress() const {
    if (deadline_.set()) return deadline_.fraction_elapsed();
    if (!target_.target_error || !(error_.estimate > *target_.target_error)) return 0;
    return std::log(known_.first / error_.estimate) / std::log(known_.first / *target_.target_error);
  }

  [[nodiscard]] bool target_reached() const {
    if (target_.target_error || target_.tile_error) return targets_reached(error_);
    return deadline_.set() && error_.estimate <= invisible_error;
  }

  [[nodiscard]] AllocationGoal allocation_goal() {
    AllocationGoal goal{0, deadline_.affordable(pool_.statistics().rays.total())};
    goal.bound_max = goal_.bound_max();
    goal.round = round_;
    if (!target_.target_error && !target_.tile_error && !deadline_.set()) return goal;
    double predicted = 0;
    for (const PixelState& pixel : film_.pixels()) predicted += pixel.variance;
    goal.squared_error = goal_.of_round(known_, predicted, round_ - known_.rounds_before);
    return goal;
  }

  /// Visits the tiles in a scattered order, so that those left out at the deadline are spread over the image.
  template <class Work>
  void each_tile(const Work& work) {
    const std::uint64_t count = tiles_.count();
    const PreviewTiles::Open open(preview_);
    for_each_tile(count, context_.settings.threads, [&](std::uint64_t index) {
      if (control_.cancelled()) return;
      typename TracerPool<T>::Lease tracer(pool_);
      work(scattered(index, count), *tracer);
    });
  }

  /// Proves what can be proven of the sampling error, and measures the worst tile; to be called when all samples are
  /// taken.
  void bound_error() {
    known_.worst_tile = film_.tile_errors().worst();
    const std::span<const PixelState> pixels = film_.pixels();
    const bool any_open = std::ranges::any_of(pixels, &PixelState::open);
    const auto certified = std::ranges::count_if(pixels, [](const auto& p) { return p.certified && !p.refined(); });
    known_.certified_share = static_cast<double>(certified) / static_cast<double>(film_.size());
    const bool theorem = !film_.bounds().empty() && scene_.output.overflow != Output::Overflow::scale;
    if (theorem)
      known_.proven = parts_.certified + parts_.undetected + (any_open ? looks_.proven() : 0) +
                      proven_refined_error(pixels, film_.display(), 0.025);
    summarize();
  }

  [[nodiscard]] ErrorEstimate::Limit limit() {
    using enum ErrorEstimate::Limit;
    const bool targets = target_.target_error || target_.tile_error;
    if (targets && targets_reached(error_)) return target;
    if (deadline_.set() && deadline_.over()) return time_budget;
    if (!targets && target_reached()) return invisible;
    if ((targets || deadline_.set()) && !goal_.leaves_room(known_)) return fixed_parts;
    // Another round would have no time, or no pixels to sample.
    return deadline_.set() && !at_maximum(film_.pixels(), target_) ? time_budget : samples_max;
  }

  Rendered finish() {
    Rendered rendered;
    rendered.statistics = pool_.statistics();
    rendered.statistics.holdout_samples = look_tracer_.samples();
    film_.write(rendered, {known_.sampled, looks_.estimate(film_.pixels()).squared, pilots_.complete()});
    rendered.error = error_;
    rendered.error.bounded = scene_.has_bounded_patches() &&
                             ((error_.depth == 0 && error_.cutoff == 0) || bound_omitted_radiance(scene_, 0).bounded);
    rendered.error.target_met = targets_reached(error_);
    rendered.error.looks = looks_.count();
    rendered.error.certified_share = known_.certified_share;
    rendered.error.limit = limit();
    return rendered;
  }

  const CompiledScene& scene_;
  RenderControl& control_;
  const Adaptive& target_;
  Deadline deadline_;
  Tiles tiles_;
  const InParallel in_parallel_ = [this](auto n, const auto& work) {
    for_each_tile(n, context_.settings.threads, work);
  };
  Film film_;
  ErrorGoal goal_;
  const std::function<Color(std::size_t)> mean_ = [this](std::size_t place) { return film_.mean(place); };
  PreviewTiles preview_;
  Pilots<T> pilots_;
  std::vector<float> cost_;  ///< rays per sample of each pixel, measured by the pilots of its tile
  TracerPool<T> pool_;
  const PartContext<T> context_;
  LookTracer<T> look_tracer_;
  Looks looks_;
  std::uint32_t round_ = 0;
  SampledParts parts_;  ///< error after the last round
  KnownErrors known_;
  ErrorEstimate error_;
};

}  // namespace tracer
