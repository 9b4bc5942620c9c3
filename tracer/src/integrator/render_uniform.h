#pragma once
/// Exactly so many samples in every pixel.

#include "tracer/src/integrator/audit.h"
#include "tracer/src/integrator/camera_rays.h"
#include "tracer/src/integrator/picture_error.h"
#include "tracer/src/integrator/pixel_sum.h"
#include "tracer/src/integrator/preview_tiles.h"
#include "tracer/src/integrator/tiles.h"
#include "tracer/src/integrator/wavefront_pool.h"
#include "tracer/src/parallel.h"

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
    if (scene_.needs.reflection || scene_.needs.refraction || scene_.needs.many_lights)
      missing_.resize(image.rgb.size() / 3);
    control_.begin(tiles_.count());
    trace(image);
    if (control_.tiles_done() < tiles_.count()) return Failure{Failure::Code::cancelled, "cancelled while tracing"};
    rendered.statistics = pool_.statistics();
    rendered.statistics.samples_min = rendered.statistics.samples_max = samples_;
    const double brightest = brightest_if_needed(scene_, image.rgb);
    const Judging judging{Levels(scene_.output, brightest), hideable(scene_, brightest)};
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
  /// second-level cache.
  static constexpr std::uint32_t batch_rays = 4096;
  /// A penumbra of 16 stratified points a pixel has a standard error of some 3 % of the light at worst.
  static constexpr std::uint32_t light_points_min = 16;

  /// What a tile collects of each of its pixels.
  struct Sums {
    PixelSum sum;
    Color squares;
    MissingLight missing;
    LayerSum layers;
  };

  /// False: cancelled.
  bool trace_tile(std::uint64_t index, Wavefront<Model>& wavefront, Image& image) {
    const std::vector<Pixel> pixels = tiles_.pixels(index);
    std::vector<Sums> sums(pixels.size());
    const std::uint32_t at_once = std::max(1u, batch_rays / static_cast<std::uint32_t>(pixels.size()));
    for (std::uint32_t first = 0; first < samples_; first += std::min(at_once, samples_ - first)) {
      const std::uint32_t last = first + std::min(at_once, samples_ - first);
      if (!wavefront.trace(batch(pixels, first, last))) return false;
      for (std::size_t i = 0; i < wavefront.radiance().size(); ++i) collect(wavefront, i, sums[i % pixels.size()]);
    }
    PreviewTiles::Tile tile(shown_, index);
    const std::lock_guard lock(tile);
    for (std::size_t i = 0; i < pixels.size(); ++i) write(sums[i], tiles_.place(pixels[i]), image);
    return true;
  }

  Batch batch(const std::vector<Pixel>& pixels, std::uint32_t first, std::uint32_t last) const {
    Batch batch;
    batch.samples.reserve(pixels.size() * (last - first));
    batch.light_points = (light_points_min + samples_ - 1) / samples_;
    for (std::uint32_t index = first; index < last; ++index)
      for (const Pixel& pixel : pixels) push(batch, scene_, uniform_sample(scene_, pixel.x, pixel.y, index, samples_));
    return batch;
  }

  void collect(const Wavefront<Model>& wavefront, std::size_t sample, Sums& sums) const {
    const Color& radiance = wavefront.radiance()[sample];
    if (!finite(radiance)) return;  // counted by the wavefront
    sums.sum.add(radiance);
    sums.squares += radiance * radiance;
    if (!missing_.empty()) {
      const MissingLight& missing = wavefront.missing()[sample];
      sums.missing.depth += missing.depth;
      sums.missing.cutoff += missing.cutoff;
      sums.missing.spared += missing.spared;
    }
    if (scene_.needs.layers) sums.layers.add(wavefront.first_hits(), sample);
  }

  void write(const Sums& sums, std::size_t at, Image& image) {
    sums.sum.write(image, at);
    if (!spread_.empty()) sums.sum.write_spread(sums.squares, spread_.data() + 3 * at);
    if (!missing_.empty()) {
      const float share = 1.0f / static_cast<float>(samples_);
      missing_[at] = {sums.missing.depth * share, sums.missing.cutoff * share, sums.missing.spared * share};
    }
    if (scene_.needs.layers) sums.layers.write(image, at);
  }

  ErrorEstimate account(Image& image, const Judging& judging) const {
    const UniformAccount known = account_for(image, {image.rgb, spread_, samples_, image.width}, missing_, judging,
                                             [&](std::uint64_t count, const std::function<void(std::uint64_t)>& work) {
                                               for_each_tile(count, settings_.threads, work);
                                             });
    ErrorEstimate error = error_estimate(known.sampled, known.missing, image.rgb.size() / 3);
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
  std::vector<float> spread_;          ///< variance of each pixel's samples, three channels
  std::vector<MissingLight> missing_;  ///< means
};

}  // namespace tracer
