#pragma once
/// Samples where they lower the error most, until it is low enough or the time is over. Each round decides from all
/// samples so far, traces fresh ones, and estimates from these what error is left (accuracy/pixel_state.h).

#include <bit>

#include "tracer/src/parallel/parallel_for.h"
#include "tracer/src/sampling/camera_samples.h"
#include "tracer/src/sampling/deadline.h"
#include "tracer/src/sampling/film.h"
#include "tracer/src/sampling/holdout.h"
#include "tracer/src/sampling/pilot.h"
#include "tracer/src/sampling/sample_allocation.h"
#include "tracer/src/sampling/tiles.h"
#include "tracer/src/sampling/tracer_pool.h"

namespace tracer {

template <class Model>
class AdaptiveRender {
 public:
  AdaptiveRender(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control)
      : scene_(scene),
        settings_(settings),
        control_(control),
        wanted_(*scene.accuracy.adaptive),
        deadline_(settings, wanted_, concurrency(settings.threads)),
        tiles_(scene.image.window()),
        film_(scene, in_parallel_),
        shown_(settings.preview, tiles_, scene.image.window(), mean_),
        pilots_(scene, film_, tiles_, deadline_, shown_),
        pool_(scene, control, scene.accuracy.approximate),
        audit_(scene, settings, control, pool_) {}

  /// Throws std::bad_alloc.
  Result<Rendered, Failure> run() {
    control_.begin(progress_parts);
    deadline_.keep_time_to_write();
    trace_pilots();
    const double book_keeping_ms = book_keeping_ms_per_pixel * static_cast<double>(film_.size());
    if (pilots_.whole() && deadline_.leaves(book_keeping_ms)) {
      refine();
    } else if (!control_.cancelled()) {
      tell_sketch();
    }
    if (control_.cancelled()) return Failure{Failure::Code::cancelled, "cancelled while tracing"};
    control_.reach(progress_parts);
    const DisplayTransform levels = film_.levels();
    Rendered rendered = finish();
    account_for_approximations<Model>(scene_, settings_, control_, levels, rendered);
    if (control_.cancelled()) return Failure{Failure::Code::cancelled, "cancelled while tracing"};
    return rendered;
  }

 private:
  static constexpr std::uint32_t rounds_max = 24;  // at eightfold growth each, far more than any pixel may grow
  static constexpr std::uint64_t progress_parts = 1000;
  static constexpr std::uint32_t batch_rays = 4096, hurried_batch_rays = 1024;
  /// What it takes to begin rounds, and half as much again: with less than that left, the pilots are the image.
  static constexpr double book_keeping_ms_per_pixel = 150e-6;
  static constexpr std::uint32_t fresh_light_points = 1;  ///< by which camera rays know a soft light; see pilot.h

  /// Where the samples of a batch belong.
  struct CameraRay {
    std::size_t place;
    std::uint8_t half;
  };

  void trace_pilots() {
    for (const std::uint32_t stride : pilot_strides(deadline_.set())) {
      each_tile([&](std::uint64_t tile, Wavefront<Model>& wavefront) { pilots_.trace(tile, stride, wavefront); });
      deadline_.learn(pool_.statistics().samples);
      if (deadline_.over()) break;
    }
    if (!control_.cancelled()) pilots_.fill_tiles();
  }

  void refine() {
    film_.begin();
    set_costs();
    if (!control_.cancelled() && !deadline_.over()) find_subpixel_features();
    deadline_.keep_time_for([&] { expect(); });
    bool sure = false;
    for (round_ = 1; round_ <= rounds_max && !control_.cancelled() && !deadline_.over(); ++round_) {
      sure = enough() && holds();
      if (sure) break;
      const SampleAllocation plan = plan_round(film_.pixels(), cost_, goal(), wanted_, round_, scene_.accuracy.seed);
      if (plan.empty) break;
      trace_round(plan);
      deadline_.learn(pool_.statistics().samples);
      deadline_.keep_time_for([&] { learn(); });
    }
    if (!sure && !control_.cancelled()) holds();
  }

  void set_costs() {
    cost_.resize(film_.size());
    for (std::uint64_t tile = 0; tile < tiles_.count(); ++tile)
      for (const Pixel& pixel : tiles_.pixels(tile)) cost_[tiles_.place(pixel)] = pilots_.cost(tile);
  }

  /// What is known of an image that there was no time to go on with: what fresh samples say alone.
  void tell_sketch() {
    constexpr double looks_least = 64, looks_most = 2048;
    const double looks = std::clamp(deadline_.audit_samples() / 4, looks_least, looks_most);
    const DisplayTransform levels = film_.levels();
    const auto choices = choose_audits(film_.size(), static_cast<std::size_t>(looks), 0, scene_.accuracy.seed);
    const auto nothing = [](std::size_t) { return 0.0; };  // is expected: rather too much is told than too little
    sampled_ = audit_.measure({.mean = mean_, .choices = choices, .stream = 0, .expected = nothing}, levels).image;
    estimate(levels);
  }

  /// Looks at what is too small for the pilot, and notes what there is to see.
  void find_subpixel_features() {
    std::vector<std::vector<SubpixelFeature>> of_tile(tiles_.count());
    for (const SubpixelFeature& scout : subpixel_features(scene_, 2 * film_.size() + 4096))
      of_tile[tiles_.index({scout.x, scout.y})].push_back(scout);
    const DisplayTransform levels = film_.levels();
    each_tile([&](std::uint64_t tile, Wavefront<Model>& wavefront) {
      if (of_tile[tile].empty() || deadline_.over()) return;
      Batch& batch = wavefront.batch();
      batch.clear();
      batch.light_points = fresh_light_points;
      for (const SubpixelFeature& scout : of_tile[tile]) {
        Sample sample = uniform_sample(scene_, scout.x, scout.y, 0, 1);
        sample.at = scout.at;
        sample.share = fresh_share;
        push(batch, scene_, sample);
      }
      if (!wavefront.trace()) return;
      for (std::size_t i = 0; i < of_tile[tile].size(); ++i) {
        const SubpixelFeature& scout = of_tile[tile][i];
        const Color& radiance = wavefront.radiance()[i];
        if (finite(radiance)) film_.note(tiles_.place({scout.x, scout.y}), scout, radiance, levels);
      }
    });
  }

  void trace_round(const SampleAllocation& plan) {
    const std::size_t at_once = deadline_.set() ? hurried_batch_rays : batch_rays;
    each_tile([&](std::uint64_t tile, Wavefront<Model>& wavefront) {
      Batch& batch = wavefront.batch();
      batch.clear();
      std::vector<CameraRay> aims;
      PreviewTiles::Tile to_display(shown_, tile);
      std::unique_lock lock(to_display);
      const auto trace = [&] {
        batch.light_points = fresh_light_points;
        lock.unlock();
        const bool traced = !aims.empty() && !control_.cancelled() &&
                            !deadline_.over_before(static_cast<double>(aims.size())) && wavefront.trace();
        lock.lock();
        if (traced) collect(wavefront, aims);
        batch.clear();
        aims.clear();
      };
      for (const Pixel& pixel : tiles_.pixels(tile)) {
        const std::size_t place = tiles_.place(pixel);
        if (film_.pixel(place).role == PixelState::Role::audited) {
          push_audit(batch, aims, pixel, plan.half[place]);
        } else if (plan.half[place] > 0) {
          push_more(batch, aims, pixel, 2 * plan.half[place]);
        }
        if (aims.size() >= at_once) trace();
      }
      trace();
    });
  }

  /// Fresh samples cover nothing but their point: what filtering textures over the pixel does to the image is an
  /// error that they are to tell.
  static constexpr double fresh_share = 0;

  void push_audit(Batch& batch, std::vector<CameraRay>& aims, const Pixel& pixel, std::uint32_t half_count) {
    for (std::uint8_t half = 0; half < 2; ++half) {
      for (std::uint32_t index = 0; index < half_count; ++index) {
        Sample sample = mirrored_sample(scene_, pixel.x, pixel.y, index, 2 * std::uint64_t{round_} + half);
        sample.share = fresh_share;
        push(batch, scene_, sample);
        aims.push_back({tiles_.place(pixel), half});
      }
    }
  }

  /// What the pixel's sequence lacks of `count` samples.
  void push_more(Batch& batch, std::vector<CameraRay>& aims, const Pixel& pixel, std::uint32_t count) {
    const std::size_t place = tiles_.place(pixel);
    PixelState& state = film_.pixel(place);
    if (state.half_count[0] == 0) film_.forget(place);  // the pilot
    state.grow();
    for (std::uint32_t index = state.half_count[0]; index < count; ++index) {
      Sample sample = fresh_sample(scene_, pixel.x, pixel.y, index, 0);
      sample.share = fresh_share;
      push(batch, scene_, sample);
      aims.push_back({place, static_cast<std::uint8_t>(index < count / 2 ? 0 : 1)});
    }
  }

  /// Pixels belong to one tile, and so to one thread at a time.
  void collect(const Wavefront<Model>& wavefront, const std::vector<CameraRay>& aims) {
    for (std::size_t i = 0; i < aims.size(); ++i) {
      const Color& radiance = wavefront.radiance()[i];
      if (!finite(radiance)) continue;  // counted by the wavefront
      PixelState& pixel = film_.pixel(aims[i].place);
      pixel.half[aims[i].half] += radiance;
      ++pixel.half_count[aims[i].half];
      if (pixel.role == PixelState::Role::audited) continue;
      film_.note(aims[i].place, wavefront.omitted(), wavefront.gbuffer(), i);
    }
  }

  void expect() {
    const DisplayTransform levels = film_.levels();
    film_.expect(levels);
    sampled_ = update_variances(film_.pixels(), film_.width(), levels, in_parallel_);
    estimate(levels);
  }

  void learn() {
    const DisplayTransform levels = film_.levels();
    sampled_ = update_variances(film_.pixels(), film_.width(), levels, in_parallel_);
    for (PixelState& pixel : film_.pixels()) pixel.forget_audit();
    estimate(levels);
  }

  void estimate(const DisplayTransform& levels) {
    const MissingError omitted = film_.missing_error(levels);
    missing_squared_ = omitted.both;
    error_ = error_estimate(sampled_, omitted, film_.size());
    first_error_ = std::max(first_error_, error_.estimate);
    control_.reach(static_cast<std::uint64_t>(progress() * progress_parts));
  }

  /// On a scale where each halving of the error is as long as the one before, or of time.
  [[nodiscard]] double progress() const {
    if (deadline_.set()) return deadline_.part_gone();
    if (!wanted_.target_error || !(error_.estimate > *wanted_.target_error)) return 0;
    return std::log(first_error_ / error_.estimate) / std::log(first_error_ / *wanted_.target_error);
  }

  /// Whether samples that decided nothing say so, too: with a target, rounds go on until they please. Else learns from
  /// what they found.
  bool holds() {
    const double affordable = deadline_.audit_samples();
    const AuditSize size =
        std::isinf(affordable) ? thorough_audit(film_.size()) : audit_within(film_.pixels(), affordable);
    const std::vector<HoldoutPixel> choices = choose_audits(film_.pixels(), size, round_, scene_.accuracy.seed);
    const auto expected = [&](std::size_t place) { return double{film_.pixel(place).variance}; };
    const DisplayTransform levels = film_.levels();
    const HoldoutResult found = [&] {
      const PreviewTiles::Open open(shown_);  // tiles are read alone
      return audit_.measure({.mean = mean_, .choices = choices, .stream = round_, .expected = expected}, levels);
    }();
    for (std::size_t i = 0; i < choices.size(); ++i) film_.suspect(choices[i].place, found.errors[i]);
    sampled_ = joined(sampled_, found.image);
    estimate(levels);
    return wanted_.target_error && error_.estimate <= *wanted_.target_error;
  }

  /// Nothing is enough before fresh samples have said so.
  [[nodiscard]] bool enough() const {
    return round_ > 1 && wanted_.target_error && error_.estimate <= *wanted_.target_error;
  }

  [[nodiscard]] AllocationGoal goal() {
    AllocationGoal goal{0, deadline_.affordable(rays())};
    if (!wanted_.target_error) return goal;
    const double wanted = 3 * static_cast<double>(film_.size()) * *wanted_.target_error * *wanted_.target_error;
    // What must be left of it for chance, as this round's samples tell; and for what was predicted too low.
    const double chance = std::clamp(sampled_.squared / std::max(sampled_.squared_upper, 1e-300), 0.5, 0.95);
    double predicted = 0;
    for (const PixelState& pixel : film_.pixels()) predicted += pixel.variance;
    const double surprise = sampled_.squared > predicted ? predicted / sampled_.squared : 1;
    goal.squared_error = std::max(wanted - missing_squared_, 0.1 * wanted) * chance * surprise;
    return goal;
  }

  /// Tiles in an order that says nothing about where they are: what the time did not suffice for is spread evenly.
  template <class Work>
  void each_tile(const Work& work) {
    const std::uint64_t count = tiles_.count();
    const PreviewTiles::Open open(shown_);
    for_each_tile(count, settings_.threads, [&](std::uint64_t index) {
      if (control_.cancelled()) return;
      typename WavefrontPool<Model>::Lease wavefront(pool_);
      work(scattered(index, count), *wavefront);
    });
  }

  [[nodiscard]] std::uint64_t rays() const { return pool_.statistics().rays.total(); }

  Rendered finish() {
    Rendered rendered;
    rendered.statistics = pool_.statistics();
    rendered.statistics.holdout_samples = audit_.samples();
    film_.write(rendered, sampled_, pilots_.whole());
    rendered.error = error_;
    rendered.error.bounded = (error_.depth == 0 && error_.cutoff == 0) || hideable(scene_, 0).bounded;
    rendered.error.target = wanted_.target_error;
    rendered.error.met = !wanted_.target_error || error_.estimate <= *wanted_.target_error;
    return rendered;
  }

  const CompiledScene& scene_;
  const RenderSettings& settings_;
  RenderControl& control_;
  const Adaptive& wanted_;
  Deadline deadline_;
  Tiles tiles_;
  const InParallel in_parallel_ = [this](std::uint64_t count, const std::function<void(std::uint64_t)>& work) {
    for_each_tile(count, settings_.threads, work);
  };
  Film film_;
  const std::function<Color(std::size_t)> mean_ = [this](std::size_t place) { return film_.mean(place); };
  PreviewTiles shown_;
  Pilots<Model> pilots_;
  std::vector<float> cost_;  ///< rays of a sample, as the pilots of its tile had
  WavefrontPool<Model> pool_;
  HoldoutEstimator<Model> audit_;
  std::uint32_t round_ = 0;
  SampledError sampled_;
  double missing_squared_ = 0, first_error_ = 0;
  ErrorEstimate error_;
};

}  // namespace tracer
