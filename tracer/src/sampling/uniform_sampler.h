#pragma once
/// Exactly so many samples in every pixel.

#include <array>
#include <span>

#include "tracer/src/parallel/parallel_for.h"
#include "tracer/src/sampling/camera_samples.h"
#include "tracer/src/sampling/holdout.h"
#include "tracer/src/sampling/image_error.h"
#include "tracer/src/sampling/pixel_accumulator.h"
#include "tracer/src/sampling/preview_tiles.h"
#include "tracer/src/sampling/tiles.h"
#include "tracer/src/sampling/tracer_pool.h"

namespace tracer {

template <class Model>
class UniformRender {
 public:
  UniformRender(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control)
      : scene_(scene),
        settings_(settings),
        control_(control),
        tiles_(scene.image.window()),
        shown_(settings.preview, tiles_, scene.image.window(), mean_),
        pool_(scene, control, scene.accuracy.approximate),
        samples_(scene.accuracy.samples) {}

  /// Throws std::bad_alloc.
  Result<Rendered, Failure> run() {
    Rendered rendered;
    Image& image = rendered.image;
    image_ = &image;
    allocate(image, scene_.image.window(), scene_.output);
    if (samples_ > 1) spread_.resize(image.rgb.size());
    lacks_.resize(tiles_.count());
    control_.begin(tiles_.count());
    trace(image);
    if (control_.tiles_done() < tiles_.count()) return Failure{Failure::Code::cancelled, "cancelled while tracing"};
    rendered.statistics = pool_.statistics();
    rendered.statistics.samples_min = rendered.statistics.samples_max = samples_;
    const double brightest = brightest_if_needed(scene_, image.rgb);
    const ErrorContext judging{DisplayTransform(scene_.output, brightest), hideable(scene_, brightest)};
    rendered.error = account(image, judging);
    account_for_approximations<Model>(scene_, settings_, control_, judging.levels, rendered);
    if (control_.cancelled()) return Failure{Failure::Code::cancelled, "cancelled while tracing"};
    return rendered;
  }

 private:
  void trace(Image& image) {
    const PreviewTiles::Open open(shown_);
    for_each_tile(tiles_.count(), settings_.threads, [&](std::uint64_t index) {
      if (control_.cancelled()) return;
      typename WavefrontPool<Model>::Lease wavefront(pool_);
      if (trace_tile(index, *wavefront, image)) control_.finish_tile();
    });
  }

  /// Camera rays traced together: enough to fill packets after most have missed, few enough to stay in the
  /// second-level cache. Of one batch are all samples of some pixels, or some of as many pixels as a packet has rays.
  static constexpr std::uint32_t batch_rays = 4096, batch_pixels_min = lanes;
  /// A penumbra of 16 stratified points a pixel has a standard error of some 3 % of the light at worst.
  static constexpr std::uint32_t light_points_min = 16;

  /// What is collected of each pixel, but for its layers: few scenes have any.
  struct Sums {
    PixelAccumulator sum;
    Color squares;
    OmittedRadiance omitted;
  };

  /// False: cancelled. Nobody looks at a tile that was not locked yet: it is, once there is all of it to see.
  bool trace_tile(std::uint64_t index, Wavefront<Model>& wavefront, Image& image) {
    const std::vector<Pixel> pixels = tiles_.pixels(index);
    const std::size_t at_once = std::max(batch_pixels_min, batch_rays / samples_);
    std::vector<OmittedSample> lacks;
    for (std::span<const Pixel> left = pixels; !left.empty(); left = left.subspan(std::min(at_once, left.size())))
      if (!trace_pixels(left.first(std::min(at_once, left.size())), wavefront, image, lacks)) return false;
    lacks_[index] = std::vector<OmittedSample>(lacks.begin(), lacks.end());  // no larger than it needs to be
    PreviewTiles::Tile tile(shown_, index);
    const std::lock_guard lock(tile);
    return true;
  }

  bool trace_pixels(std::span<const Pixel> pixels, Wavefront<Model>& wavefront, Image& image,
                    std::vector<OmittedSample>& lacks) {
    std::array<Sums, batch_pixels_min> begun;  // of pixels that have more samples than a batch
    std::array<LayerAccumulator, batch_pixels_min> begun_layers;
    const std::uint32_t at_once = std::max(1u, batch_rays / static_cast<std::uint32_t>(pixels.size()));
    for (std::uint32_t first = 0, last = 0; first < samples_; first = last) {
      last = first + std::min(at_once, samples_ - first);
      fill(wavefront.batch(), scene_, pixels, {first, last, samples_});
      wavefront.batch().light_points = (light_points_min + samples_ - 1) / samples_;
      if (!wavefront.trace()) return false;
      if (samples_ == 1) write_each(pixels, wavefront, image, lacks);
      const Part part{pixels.size(), first == 0, last == samples_};
      if (samples_ > 1)
        sum_up(part, wavefront, begun,
               [&](std::size_t i, const Sums& sums) { write(sums, tiles_.place(pixels[i]), image, lacks); });
      if (scene_.needs.layers)
        sum_up(part, wavefront, begun_layers,
               [&](std::size_t i, const LayerAccumulator& sums) { sums.write(image, tiles_.place(pixels[i])); });
    }
    return true;
  }

  /// Pixels of one sample each: there is nothing to sum up.
  void write_each(std::span<const Pixel> pixels, const Wavefront<Model>& wavefront, Image& image,
                  std::vector<OmittedSample>& lacks) const {
    const std::vector<Color>& radiance = wavefront.radiance();
    const std::vector<OmittedRadiance>& omitted = wavefront.omitted();
    const Tiles tiles = tiles_;  // as the film's place, read once and not for each pixel
    float* const film = image.rgb.data();
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const Color& seen = radiance[i];
      if (!finite(seen)) continue;  // it is counted, and stays black
      float* const rgb = film + 3 * tiles.place(pixels[i]);
      rgb[0] = film_value(seen.r);
      rgb[1] = film_value(seen.g);
      rgb[2] = film_value(seen.b);
    }
    for (std::size_t i = 0; i < omitted.size(); ++i)
      if (finite(radiance[i])) note(omitted[i], tiles_.place(pixels[i]), lacks);
  }

  /// Of the samples of so many pixels, all first ones first.
  struct Part {
    std::size_t pixels;
    bool first, last;
  };
  /// Sums up what the batch has of each pixel; of the last part calls write(i, sums).
  template <class Sum, class Write>
  void sum_up(const Part& part, const Wavefront<Model>& wavefront, std::array<Sum, batch_pixels_min>& begun,
              const Write& write) const {
    const std::size_t samples = wavefront.radiance().size();
    for (std::size_t i = 0; i < part.pixels; ++i) {
      Sum sums;
      if (!part.first) sums = begun[i];
      for (std::size_t sample = i; sample < samples; sample += part.pixels)
        if (finite(wavefront.radiance()[sample])) collect(wavefront, sample, sums);  // others it has counted
      if (part.last) {
        write(i, sums);
      } else {
        begun[i] = sums;
      }
    }
  }

  void collect(const Wavefront<Model>& wavefront, std::size_t sample, LayerAccumulator& sums) const {
    sums.add(wavefront.gbuffer(), sample);
  }
  void collect(const Wavefront<Model>& wavefront, std::size_t sample, Sums& sums) const {
    const Color& radiance = wavefront.radiance()[sample];
    sums.sum.add(radiance);
    if (!spread_.empty()) sums.squares += radiance * radiance;
    if (wavefront.omitted().empty()) return;
    const OmittedRadiance& omitted = wavefront.omitted()[sample];
    sums.omitted.depth += omitted.depth;
    sums.omitted.cutoff += omitted.cutoff;
    sums.omitted.culled += omitted.culled;
  }

  void write(const Sums& sums, std::size_t at, Image& image, std::vector<OmittedSample>& lacks) {
    sums.sum.write(image.rgb.data() + 3 * at);
    if (!spread_.empty()) sums.sum.write_spread(sums.squares, spread_.data() + 3 * at);
    const auto [depth, cutoff, culled] = sums.omitted;
    const float share = 1.0f / static_cast<float>(samples_);
    note({depth * share, cutoff * share, culled * share}, at, lacks);
  }

  static void note(const OmittedRadiance& omitted, std::size_t at, std::vector<OmittedSample>& lacks) {
    if (omitted.depth + omitted.cutoff + omitted.culled > 0) lacks.push_back({static_cast<std::uint32_t>(at), omitted});
  }

  ErrorEstimate account(Image& image, const ErrorContext& judging) const {
    const UniformAccount known = account_for(image, {image.rgb, spread_, samples_, image.width}, lacks_, judging,
                                             [&](std::uint64_t count, const std::function<void(std::uint64_t)>& work) {
                                               for_each_tile(count, settings_.threads, work);
                                             });
    ErrorEstimate error = error_estimate(known.sampled, known.omitted, image.rgb.size() / 3);
    error.bounded = judging.hideable.bounded || (error.depth == 0 && error.cutoff == 0);
    error.target = scene_.accuracy.target_error;
    error.met = !error.target || error.estimate <= *error.target;
    return error;
  }

  const CompiledScene& scene_;
  const RenderSettings& settings_;
  RenderControl& control_;
  Tiles tiles_;
  const Image* image_ = nullptr;
  const PreviewTiles::Mean mean_ = [this](std::size_t place) {
    const float* const rgb = image_->rgb.data() + 3 * place;
    return Color{rgb[0], rgb[1], rgb[2]};
  };
  PreviewTiles shown_;
  WavefrontPool<Model> pool_;
  std::uint32_t samples_;
  std::vector<float> spread_;                      ///< variance of each pixel's samples, three channels
  std::vector<std::vector<OmittedSample>> lacks_;  ///< of each tile's pixels
};

}  // namespace tracer
