#pragma once
/// Error by the limits of a document, `max_depth` and `cutoff`: of the rays that they end. It is measured like an
/// approximation. Pixels are drawn in proportion to the largest effect of their ended rays. Two fresh samples of each
/// are traced with the limits and without them, where chance continues the ended rays; all other rays are the same. The
/// product of what both samples change in the displayed pixel, divided by the probability of the draw, estimates the
/// squared error of the image without bias, as far as the curve of the display is straight (Hansen & Hurwitz 1943, "On
/// the theory of sampling from finite populations"). The samples of the image do not pay for it.

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <span>
#include <vector>

#include "tracer/src/sampling/image_error.h"
#include "tracer/src/sampling/look_tracer.h"

namespace tracer {

struct TruncationError : LookCounts {
  OmittedError error;
  bool bounded = true;  ///< the radiance of the scene has a bound, or no ray was ended
  TruncationBounds bounds;

  /// Adds the error to the layer `error`, to each pixel in proportion to its bound.
  void add_to(std::vector<float>& layer) const {
    for (std::size_t i = 0; i < std::min(layer.size(), bounds.squared.size()); ++i)
      layer[i] = std::sqrt(layer[i] * layer[i] + bounds.squared[i] * static_cast<float>(error.both / bounds.sum / 3));
  }
};

class TruncationLooks {
 public:
  /// `image`: the render, until now only of samples whose ended rays count. `value`: the image's pixel at a place.
  /// References must outlive it.
  TruncationLooks(const PartContext& image, const std::function<Color(std::size_t)>& value)
      : scene_(image.scene),
        settings_(image.settings),
        control_(image.control),
        image_(image.pool.statistics()),
        value_(value),
        pool_(image.pool.make(), image.scene, image.control, image.scene.accuracy.approximate) {}

  /// Takes few rays beside those of the image; more where they may show that adaptive samples can reach a target.
  /// `omitted`: see TruncationBounds. Throws std::bad_alloc.
  TruncationError measure(std::span<const float> omitted, const ErrorContext& context) {
    constexpr std::size_t few = 16, enough = 64, most = 2048;
    // Culled light counts as it is, and any light may be where none has a bound.
    const bool known = context.bound.bounded && !scene_.needs.many_lights;
    const double radiance = known ? context.bound.radiance : std::max(1.0, context.bound.radiance);
    TruncationError found;
    found.bounds = truncation_bounds(omitted, value_, radiance, context.display);
    if (found.bounds.squared.empty()) return found;
    const std::size_t least = std::clamp<std::size_t>(image_.samples / 64, 1, enough);
    const double bound = found.bounds.sum, target = scene_.accuracy.adaptive ? scene_.accuracy.target().value_or(0) : 0,
                 squared_target = 3 * static_cast<double>(omitted.size()) * target * target;
    for (std::size_t& taken = found.looks; taken < most && !control_.cancelled(); taken = both_.size()) {
      const SampledError error = truncation_error(both_, bound);
      if (taken >= few && error.squared_upper < 1.7 * error.squared) break;
      const bool decides = 2 * error.squared < squared_target && 2 * error.squared_upper > squared_target;
      if (taken >= least && pool_.statistics().rays.total() > image_.rays.total() / (decides ? 4 : 256)) break;
      const std::size_t more = std::clamp(taken, std::min(few, least), most - taken);
      add(draw_looks(found.bounds.squared, more, taken, scene_.accuracy.seed), found.bounds.throughput / 4, context);
    }
    const auto part = [&](bool has, std::span<const double> squares) {
      return has ? truncation_error(squares, bound).squared_upper : 0;
    };
    found.error = {.depth = part(ends_, depth_), .cutoff = part(cuts_, cutoff_), .both = part(true, both_)};
    found.bounded = context.bound.bounded;
    found.statistics = pool_.statistics();
    found.statistics.holdout_samples = found.statistics.samples;
    return found;
  }

 private:
  /// Adds looks. Rays that are continued have `throughput` at least.
  void add(std::span<const Look> looks, double throughput, const ErrorContext& context) {
    constexpr std::size_t unit_looks = 16;
    const std::size_t before = both_.size();
    for (std::vector<double>* squares : {&cutoff_, &depth_, &both_}) squares->resize(before + looks.size());
    for_each_tile((looks.size() + unit_looks - 1) / unit_looks, settings_.threads, [&](std::uint64_t unit) {
      const std::size_t first = unit * unit_looks;
      const std::span<const Look> part = looks.subspan(first, std::min(unit_looks, looks.size() - first));
      const auto tracer = pool_.lease();
      fill((*tracer).batch(), part, before);
      std::array<std::vector<Color>, 3> radiance;  // with the limits, without `cutoff`, without both
      for (std::size_t i = 0; i < radiance.size(); ++i) {
        const bool changes = i == 0 || (i == 1 ? cuts_ : ends_);
        (*tracer).batch().lifted = {i > 0 && scene_.accuracy.cutoff, i > 1, throughput};
        if (changes && (control_.cancelled() || !(*tracer).trace())) return;
        radiance[i] = changes ? (*tracer).radiance() : radiance[i - 1];
      }
      for (std::size_t i = 0; i < part.size(); ++i) {
        const auto square = [&](std::size_t with, std::size_t without) {
          const auto added = [&](std::size_t at) { return radiance[without][at] + radiance[with][at] * -1.0; };
          return part[i].weight *
                 squared_change(value_(part[i].place), {added(2 * i), added(2 * i + 1)}, context.display);
        };
        cutoff_[before + first + i] = square(0, 1);
        depth_[before + first + i] = square(1, 2);
        both_[before + first + i] = square(0, 2);
      }
    });
  }

  /// Two samples for each look, which none before has.
  void fill(Batch& batch, std::span<const Look> looks, std::size_t before) const {
    constexpr std::uint64_t first_stream = std::uint64_t{1} << 41;  // beyond the streams of the image and its looks
    const Tiles tiles(scene_.image.window());
    batch.clear();
    for (const Look& look : looks)
      for (std::uint32_t half = 0; half < 2; ++half) {
        const Pixel pixel = tiles.pixel(look.place);
        Sample sample =
            fresh_sample(scene_, pixel.x, pixel.y, 0, first_stream + 2 * (before + std::uint64_t{look.index}) + half);
        sample.share = look_share(scene_, false);
        push(batch, scene_, sample);
      }
  }

  const CompiledScene& scene_;
  const RenderSettings& settings_;
  RenderControl& control_;
  const RenderStatistics image_;
  const std::function<Color(std::size_t)>& value_;
  const bool cuts_ = scene_.accuracy.cutoff && image_.cut_branches + image_.culled_shadow_rays > 0;
  const bool ends_ = image_.truncated_branches > 0;
  TracerPool<> pool_;
  std::vector<double> cutoff_, depth_, both_;  ///< squared errors over the image, of each look
};

}  // namespace tracer
