#pragma once
/// Takes samples where they lower the error most, until the target error is reached or the time budget is used up. Each
/// round allocates samples from all samples so far, traces fresh ones and estimates the remaining error from them; see
/// sampling/pixel_state.h.

#include <bit>

#include "tracer/src/integrators/tracer_concept.h"
#include "tracer/src/parallel/parallel_for.h"
#include "tracer/src/sampling/camera_samples.h"
#include "tracer/src/sampling/deadline.h"
#include "tracer/src/sampling/film.h"
#include "tracer/src/sampling/holdout.h"
#include "tracer/src/sampling/pilot.h"
#include "tracer/src/sampling/sample_allocation.h"
#include "tracer/src/sampling/tiles.h"

namespace tracer {

template <Tracer T>
class AdaptiveSampler {
 public:
  AdaptiveSampler(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control)
      : scene_(scene),
        settings_(settings),
        control_(control),
        target_(*scene.accuracy.adaptive),
        deadline_(settings, target_, concurrency(settings.threads)),
        tiles_(scene.image.window()),
        film_(scene, in_parallel_),
        preview_(settings.preview, tiles_, scene.image.window(), mean_),
        pilots_(scene, film_, tiles_, deadline_, preview_),
        pool_(scene, control, scene.accuracy.approximate),
        holdout_(scene, settings, control, pool_) {}

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
    if (control_.cancelled()) return Failure{Failure::Code::cancelled, "cancelled while tracing"};
    control_.reach(progress_parts);
    const DisplayTransform display = film_.display();
    Rendered rendered = finish();
    estimate_approximation_error<T>(scene_, settings_, control_, display, rendered);
    if (control_.cancelled()) return Failure{Failure::Code::cancelled, "cancelled while tracing"};
    return rendered;
  }

 private:
  static constexpr std::uint32_t rounds_max = 24;  // at eightfold growth each, far more than any pixel may grow
  static constexpr std::uint64_t progress_parts = 1000;
  static constexpr std::uint32_t batch_rays = 4096, batch_rays_with_deadline = 1024;
  /// 1.5 times the overhead of the first round; with less time left, the pilots are the image.
  static constexpr double round_overhead_ms_per_pixel = 150e-6;
  static constexpr std::uint32_t fresh_light_points = 1;  ///< points per area light of fresh samples; see pilot.h
  /// Fresh samples are point samples: the effect of filtering textures over the pixel is an error that they measure.
  static constexpr double fresh_share = 0;

  /// The pixel and half that a sample of a batch is added to.
  struct SampleTarget {
    std::size_t place;
    std::uint8_t half;
  };

  void trace_pilots() {
    for (const std::uint32_t stride : pilot_strides(deadline_.set())) {
      each_tile([&](std::uint64_t tile, T& tracer) { pilots_.trace(tile, stride, tracer); });
      deadline_.measure_rate(pool_.statistics().samples);
      if (deadline_.over()) break;
    }
    if (!control_.cancelled()) pilots_.fill_tiles();
  }

  void refine() {
    film_.begin();
    set_costs();
    if (!control_.cancelled() && !deadline_.over()) sample_features();
    deadline_.reserve_time_for([&] {
      film_.predict_variance(film_.display());
      update_estimate();
    });
    bool validated = false;
    for (round_ = 1; round_ <= rounds_max && !control_.cancelled() && !deadline_.over(); ++round_) {
      validated = target_reached() && validate_estimate();
      if (validated) break;
      const SampleAllocation allocation =
          allocate_samples(film_.pixels(), cost_, goal(), target_, round_, scene_.accuracy.seed);
      if (allocation.empty) break;
      trace_round(allocation);
      deadline_.measure_rate(pool_.statistics().samples);
      deadline_.reserve_time_for([&] {
        update_estimate();
        for (PixelState& pixel : film_.pixels()) pixel.discard_holdout();
      });
    }
    if (!validated && !control_.cancelled()) validate_estimate();
  }

  void set_costs() {
    cost_.resize(film_.size());
    for (std::uint64_t tile = 0; tile < tiles_.count(); ++tile)
      for (const Pixel& pixel : tiles_.pixels(tile)) cost_[tiles_.place(pixel)] = pilots_.cost(tile);
  }

  /// Estimates the error of an image without rounds from holdout samples alone.
  void estimate_pilots() {
    constexpr double count_min = 64, count_max = 2048;
    const double count = std::clamp(deadline_.holdout_samples() / 4, count_min, count_max);
    const DisplayTransform display = film_.display();
    const auto pixels = select_holdout_pixels(film_.size(), static_cast<std::size_t>(count), 0, scene_.accuracy.seed);
    const auto zero = [](std::size_t) { return 0.0; };  // no prediction, so that the error is rather overestimated
    sampled_ = holdout_.measure({.mean = mean_, .pixels = pixels, .stream = 0, .predicted = zero}, display).image;
    estimate(display);
  }

  /// Samples features that are too small for the pilots, and adds what is visible to the film.
  void sample_features() {
    std::vector<std::vector<SubpixelFeature>> of_tile(tiles_.count());
    for (const SubpixelFeature& feature : find_subpixel_features(scene_, 2 * film_.size() + 4096))
      of_tile[tiles_.index({feature.x, feature.y})].push_back(feature);
    const DisplayTransform display = film_.display();
    each_tile([&](std::uint64_t tile, T& tracer) {
      if (of_tile[tile].empty() || deadline_.over()) return;
      Batch& batch = tracer.batch();
      batch.clear();
      batch.light_points = fresh_light_points;
      for (const SubpixelFeature& feature : of_tile[tile]) {
        Sample sample = uniform_sample(scene_, feature.x, feature.y, 0, 1);
        sample.at = feature.at;
        sample.share = fresh_share;
        push(batch, scene_, sample);
      }
      if (!tracer.trace()) return;
      for (std::size_t i = 0; i < of_tile[tile].size(); ++i) {
        const SubpixelFeature& feature = of_tile[tile][i];
        const Color& radiance = tracer.radiance()[i];
        if (finite(radiance)) film_.add_feature(tiles_.place({feature.x, feature.y}), feature, radiance, display);
      }
    });
  }

  void trace_round(const SampleAllocation& allocation) {
    const std::size_t at_once = deadline_.set() ? batch_rays_with_deadline : batch_rays;
    each_tile([&](std::uint64_t tile, T& tracer) {
      Batch& batch = tracer.batch();
      batch.clear();
      std::vector<SampleTarget> targets;
      PreviewTiles::Tile preview(preview_, tile);
      std::unique_lock lock(preview);
      const auto trace = [&] {
        batch.light_points = fresh_light_points;
        lock.unlock();
        const bool traced = !targets.empty() && !control_.cancelled() &&
                            !deadline_.over_before(static_cast<double>(targets.size())) && tracer.trace();
        lock.lock();
        if (traced) add_samples(tracer, targets);
        batch.clear();
        targets.clear();
      };
      for (const Pixel& pixel : tiles_.pixels(tile)) {
        const std::size_t place = tiles_.place(pixel);
        if (film_.pixel(place).role == PixelState::Role::holdout) {
          push_holdout(batch, targets, pixel, allocation.half[place]);
        } else if (allocation.half[place] > 0) {
          push_refinement(batch, targets, pixel, 2 * allocation.half[place]);
        }
        if (targets.size() >= at_once) trace();
      }
      trace();
    });
  }

  void push_holdout(Batch& batch, std::vector<SampleTarget>& targets, const Pixel& pixel, std::uint32_t half_count) {
    for (std::uint8_t half = 0; half < 2; ++half) {
      for (std::uint32_t index = 0; index < half_count; ++index) {
        Sample sample = mirrored_sample(scene_, pixel.x, pixel.y, index, 2 * std::uint64_t{round_} + half);
        sample.share = fresh_share;
        push(batch, scene_, sample);
        targets.push_back({tiles_.place(pixel), half});
      }
    }
  }

  /// Continues the pixel's sequence up to `count` samples.
  void push_refinement(Batch& batch, std::vector<SampleTarget>& targets, const Pixel& pixel, std::uint32_t count) {
    const std::size_t place = tiles_.place(pixel);
    PixelState& state = film_.pixel(place);
    if (state.half_count[0] == 0) film_.discard_samples(place);  // the pilot
    state.grow();
    for (std::uint32_t index = state.half_count[0]; index < count; ++index) {
      Sample sample = fresh_sample(scene_, pixel.x, pixel.y, index, 0);
      sample.share = fresh_share;
      push(batch, scene_, sample);
      targets.push_back({place, static_cast<std::uint8_t>(index < count / 2 ? 0 : 1)});
    }
  }

  /// A pixel belongs to one tile, and so to one thread at a time.
  void add_samples(const T& tracer, const std::vector<SampleTarget>& targets) {
    for (std::size_t i = 0; i < targets.size(); ++i) {
      const Color& radiance = tracer.radiance()[i];
      if (!finite(radiance)) continue;  // counted by the tracer
      PixelState& pixel = film_.pixel(targets[i].place);
      pixel.half[targets[i].half] += radiance;
      ++pixel.half_count[targets[i].half];
      if (pixel.role == PixelState::Role::holdout) continue;
      film_.add_sample(targets[i].place, tracer.omitted(), tracer.gbuffer(), i);
    }
  }

  void update_estimate() {
    const DisplayTransform display = film_.display();
    sampled_ = update_variances(film_.pixels(), film_.width(), display, in_parallel_);
    estimate(display);
  }

  void estimate(const DisplayTransform& display) {
    const OmittedError omitted = film_.omitted_error(display);
    omitted_squared_ = omitted.both;
    error_ = error_estimate(sampled_, omitted, film_.size());
    first_error_ = std::max(first_error_, error_.estimate);
    control_.reach(static_cast<std::uint64_t>(progress() * progress_parts));
  }

  /// Fraction of the time budget, or of the way to the target error on a logarithmic scale.
  [[nodiscard]] double progress() const {
    if (deadline_.set()) return deadline_.fraction_elapsed();
    if (!target_.target_error || !(error_.estimate > *target_.target_error)) return 0;
    return std::log(first_error_ / error_.estimate) / std::log(first_error_ / *target_.target_error);
  }

  /// Validates the estimate with holdout samples. Returns true when the target error is still met; otherwise updates
  /// the variances.
  bool validate_estimate() {
    const double affordable = deadline_.holdout_samples();
    const HoldoutBudget budget =
        std::isinf(affordable) ? full_holdout_budget(film_.size()) : holdout_budget_within(film_.pixels(), affordable);
    const std::vector<HoldoutPixel> pixels =
        select_holdout_pixels(film_.pixels(), budget, round_, scene_.accuracy.seed);
    const auto predicted = [&](std::size_t place) { return double{film_.pixel(place).variance}; };
    const DisplayTransform display = film_.display();
    const HoldoutResult result = [&] {
      const PreviewTiles::Open open(preview_);  // tiles are only read
      return holdout_.measure({.mean = mean_, .pixels = pixels, .stream = round_, .predicted = predicted}, display);
    }();
    for (std::size_t i = 0; i < pixels.size(); ++i) film_.raise_variance(pixels[i].place, result.errors[i]);
    sampled_ = upper_bound(sampled_, result.image);
    estimate(display);
    return target_.target_error && error_.estimate <= *target_.target_error;
  }

  /// The first round never ends sampling: its estimate has not been validated.
  [[nodiscard]] bool target_reached() const {
    return round_ > 1 && target_.target_error && error_.estimate <= *target_.target_error;
  }

  [[nodiscard]] AllocationGoal goal() {
    AllocationGoal goal{0, deadline_.affordable(pool_.statistics().rays.total())};
    if (!target_.target_error) return goal;
    const double squared_target = 3 * static_cast<double>(film_.size()) * *target_.target_error * *target_.target_error;
    // Margins for the uncertainty of the estimate and for predictions that were too low.
    const double margin = std::clamp(sampled_.squared / std::max(sampled_.squared_upper, 1e-300), 0.5, 0.95);
    double predicted = 0;
    for (const PixelState& pixel : film_.pixels()) predicted += pixel.variance;
    const double correction = sampled_.squared > predicted ? predicted / sampled_.squared : 1;
    goal.squared_error = std::max(squared_target - omitted_squared_, 0.1 * squared_target) * margin * correction;
    return goal;
  }

  /// Visits the tiles in a scattered order, so that those left out at the deadline are spread over the image.
  template <class Work>
  void each_tile(const Work& work) {
    const std::uint64_t count = tiles_.count();
    const PreviewTiles::Open open(preview_);
    for_each_tile(count, settings_.threads, [&](std::uint64_t index) {
      if (control_.cancelled()) return;
      typename TracerPool<T>::Lease tracer(pool_);
      work(scattered(index, count), *tracer);
    });
  }

  Rendered finish() {
    Rendered rendered;
    rendered.statistics = pool_.statistics();
    rendered.statistics.holdout_samples = holdout_.samples();
    film_.write(rendered, sampled_, pilots_.complete());
    rendered.error = error_;
    rendered.error.bounded = (error_.depth == 0 && error_.cutoff == 0) || bound_omitted_radiance(scene_, 0).bounded;
    rendered.error.target = target_.target_error;
    rendered.error.target_met = !target_.target_error || error_.estimate <= *target_.target_error;
    return rendered;
  }

  const CompiledScene& scene_;
  const RenderSettings& settings_;
  RenderControl& control_;
  const Adaptive& target_;
  Deadline deadline_;
  Tiles tiles_;
  const InParallel in_parallel_ = [this](std::uint64_t count, const std::function<void(std::uint64_t)>& work) {
    for_each_tile(count, settings_.threads, work);
  };
  Film film_;
  const std::function<Color(std::size_t)> mean_ = [this](std::size_t place) { return film_.mean(place); };
  PreviewTiles preview_;
  Pilots<T> pilots_;
  std::vector<float> cost_;  ///< rays per sample of each pixel, measured by the pilots of its tile
  TracerPool<T> pool_;
  HoldoutEstimator<T> holdout_;
  std::uint32_t round_ = 0;
  SampledError sampled_;
  double omitted_squared_ = 0, first_error_ = 0;
  ErrorEstimate error_;
};

}  // namespace tracer
