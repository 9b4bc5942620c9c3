#pragma once
/// Mutants of render(): tracers and pools of looks with one fault each. The samplers are those of the product.

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>
#include <vector>

#include "tracer/render.h"
#include "tracer/src/integrators/whitted/wavefront.h"
#include "tracer/src/sampling/adaptive_sampler.h"
#include "tracer/src/sampling/uniform_sampler.h"

namespace error_coverage::mutants {

using Outcome = tracer::Result<tracer::Rendered, tracer::Failure>;
using Intact = tracer::Wavefront<tracer::AllFeatures>;

/// Precondition: the scene has a target error or a time budget.
template <class T, class Looks = tracer::LookPool>
Outcome render_adaptively(const tracer::CompiledScene& scene, const tracer::RenderSettings& settings,
                          tracer::RenderControl& control) {
  return tracer::AdaptiveSampler<T, Looks>(scene, settings, control).run();
}

/// Precondition: the scene has fixed samples.
template <class T>
Outcome render_uniformly(const tracer::CompiledScene& scene, const tracer::RenderSettings& settings,
                         tracer::RenderControl& control) {
  return tracer::UniformSampler<T>(scene, settings, control).run();
}

/// True for about one in `one_in` pixels.
inline bool selected(std::uint64_t pixel, std::uint64_t one_in) { return tracer::mix(pixel) % one_in == 0; }

inline tracer::CompiledScene without_occluders(tracer::CompiledScene scene) {
  for (tracer::CompiledLight& light : scene.lights) light.shadows = false;
  return scene;
}

enum class Samples { all, pilots };

/// Shadow rays of 1 % of the pixels hit no occluder.
template <Samples samples>
class OmitsOccluders : public Intact {
 public:
  OmitsOccluders(const tracer::CompiledScene& scene, const tracer::RenderControl& control,
                 const tracer::Approximations& approximations)
      : Intact(scene, control, approximations),
        scene_(without_occluders(scene)),
        without_occluders_(scene_, control, approximations) {}

  bool trace() {
    without_occluders_.batch() = batch();
    if (!Intact::trace() || !without_occluders_.trace()) return false;
    radiance_ = Intact::radiance();
    for (std::size_t i = 0; i < radiance_.size(); ++i)
      if (faulty(i)) radiance_[i] = without_occluders_.radiance()[i];
    return true;
  }
  [[nodiscard]] const std::vector<tracer::Color>& radiance() const { return radiance_; }

 private:
  [[nodiscard]] bool faulty(std::size_t i) {
    const auto x = static_cast<std::uint32_t>(batch().x[i]), y = static_cast<std::uint32_t>(batch().y[i]);
    const std::uint64_t pixel = tracer::pixel_index(scene_, x, y);
    if (samples == Samples::pilots && batch().samples[i].key != tracer::pixel_key(pixel, scene_.accuracy.seed))
      return false;
    return selected(pixel, 100);
  }

  tracer::CompiledScene scene_;
  Intact without_occluders_;
  std::vector<tracer::Color> radiance_;
};

/// Intervals: the rule for shadows finds no occluder.
struct BoundsWithoutOccluders : Intact {
  using Intact::Intact;
  static std::vector<tracer::RadianceInterval> bounds(const tracer::CompiledScene& scene,
                                                      const tracer::Approximations& approximate,
                                                      const tracer::InParallel& in_parallel,
                                                      const tracer::RenderControl& control) {
    return Intact::bounds(without_occluders(scene), approximate, in_parallel, control);
  }
};

/// Intervals: one in `one_in` pixels has the darkest of its surfaces alone.
template <std::uint64_t one_in>
struct BoundsOfOneSurface : Intact {
  using Intact::Intact;
  static std::vector<tracer::RadianceInterval> bounds(const tracer::CompiledScene& scene,
                                                      const tracer::Approximations& approximate,
                                                      const tracer::InParallel& in_parallel,
                                                      const tracer::RenderControl& control) {
    std::vector<tracer::RadianceInterval> intervals = Intact::bounds(scene, approximate, in_parallel, control);
    for (std::size_t i = 0; i < intervals.size(); ++i)
      if (selected(i, one_in)) intervals[i] = {intervals[i].low, intervals[i].low, false};
    return intervals;
  }
};

/// Intervals of the image with approximations, also where those of the exact image are needed.
struct BoundsOfApproximations : Intact {
  using Intact::Intact;
  static std::vector<tracer::RadianceInterval> bounds(const tracer::CompiledScene& scene,
                                                      const tracer::Approximations& /*approximate*/,
                                                      const tracer::InParallel& in_parallel,
                                                      const tracer::RenderControl& control) {
    return Intact::bounds(scene, scene.accuracy.approximate, in_parallel, control);
  }
};

/// The second half of a pixel's samples repeats the first.
class RepeatsHalves : public Intact {
 public:
  RepeatsHalves(const tracer::CompiledScene& scene, const tracer::RenderControl& control,
                const tracer::Approximations& approximations)
      : Intact(scene, control, approximations), scene_(scene) {}

  bool trace() {
    for (std::size_t i = 0; i < batch().samples.size(); ++i) repeat(i);
    return Intact::trace();
  }

 private:
  void repeat(std::size_t i) {
    tracer::Batch::Sample& sample = batch().samples[i];
    const double x = std::floor(batch().x[i]), y = std::floor(batch().y[i]);
    const std::pair pixel{static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y)};
    tracer::Vec2 at{};
    if (!scene_.accuracy.adaptive) {
      const std::uint32_t count = scene_.accuracy.samples;
      sample.index %= count / 2;
      at = tracer::pixel_sample(sample.key, sample.index, count);
    } else if (sample.key == tracer::fresh_sample(scene_, pixel.first, pixel.second, sample.index, 1).seeds.key) {
      const tracer::Sample first = tracer::fresh_sample(scene_, pixel.first, pixel.second, sample.index, 0);
      sample = first.seeds;
      at = first.at;
    } else {
      return;
    }
    batch().x[i] = x + at.x;
    batch().y[i] = y + at.y;
  }

  const tracer::CompiledScene& scene_;
};

/// Pixels in which a look finds an error of more than a level leave the pool, as if all errors like theirs had been
/// repaired with them.
struct LooksWithoutFinds : tracer::LookPool {
  [[nodiscard]] tracer::EstimatedSum estimate(std::span<const tracer::PixelState> pixels) const {
    constexpr double level = 3;  // squared, summed over the channels
    std::vector<tracer::PixelState> left(pixels.begin(), pixels.end());
    for (const tracer::LookError& look : errors())
      if (look.squared_error > level) left[look.place].certified = true;
    return LookPool::estimate(left);
  }
};

/// Every open pixel has the same probability.
struct UniformLooks : tracer::LookPool {
  tracer::LookDraws draw(std::span<tracer::PixelState> pixels, std::size_t count, std::uint64_t seed) {
    std::vector<tracer::PixelState> equal(pixels.begin(), pixels.end());
    float largest = 0;
    for (tracer::PixelState& pixel : equal) {
      if (pixel.open()) largest = std::max(largest, pixel.bound);
      pixel.bound = 1;
      pixel.variance = 0;
      pixel.edge = false;
    }
    tracer::LookDraws draws = LookPool::draw(equal, count, seed);
    for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i].looks = equal[i].looks;
    draws.range *= largest;
    return draws;
  }
};

/// Claims without one part of the error.
template <double tracer::ErrorEstimate::*part>
Outcome render_without_part(const tracer::CompiledScene& scene, const tracer::RenderSettings& settings,
                            tracer::RenderControl& control) {
  Outcome rendered = tracer::render(scene, settings, control);
  if (!rendered) return rendered;
  tracer::ErrorEstimate& error = rendered->error;
  error.estimate = std::sqrt(std::max(0.0, error.estimate * error.estimate - error.*part * (error.*part)));
  return rendered;
}

/// Claims of `percent` of the estimate.
template <int percent>
Outcome render_with_scaled_claim(const tracer::CompiledScene& scene, const tracer::RenderSettings& settings,
                                 tracer::RenderControl& control) {
  Outcome rendered = tracer::render(scene, settings, control);
  if (rendered) rendered->error.estimate *= percent / 100.0;
  return rendered;
}

/// Light of glowing surfaces is multiplied by `percent`, as if the weights of both ways to sample it had that sum.
template <int percent>
Outcome render_with_scaled_emission(const tracer::CompiledScene& scene, const tracer::RenderSettings& settings,
                                    tracer::RenderControl& control) {
  tracer::CompiledScene faulty = scene;
  for (tracer::CompiledMaterial& material : faulty.terms)
    material.emitted_ambient = material.emitted_ambient * (percent / 100.0);
  return tracer::render(faulty, settings, control);
}

/// Paths end after `depth` bounces, as if Russian roulette divided by no probability, and that is not charged.
template <int depth>
Outcome render_without_long_paths(const tracer::CompiledScene& scene, const tracer::RenderSettings& settings,
                                  tracer::RenderControl& control) {
  tracer::CompiledScene faulty = scene;
  faulty.accuracy.max_depth = depth;
  Outcome rendered = tracer::render(faulty, settings, control);
  if (!rendered) return rendered;
  tracer::ErrorEstimate& error = rendered->error;
  error.estimate = std::sqrt(std::max(0.0, error.estimate * error.estimate - error.depth * error.depth));
  return rendered;
}

}  // namespace error_coverage::mutants
