#pragma once
/// Takes the same number of samples in every pixel.

#include <array>
#include <span>

#include "tracer/src/integrators/tracer_concept.h"
#include "tracer/src/parallel/parallel_for.h"
#include "tracer/src/sampling/camera_samples.h"
#include "tracer/src/sampling/image_error.h"
#include "tracer/src/sampling/look_tracer.h"
#include "tracer/src/sampling/pixel_state.h"
#include "tracer/src/sampling/tiles.h"

namespace tracer {

template <Tracer T>
class UniformSampler {
 public:
  UniformSampler(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control)
      : scene_(scene),
        settings_(settings),
        control_(control),
        tiles_(scene.image.window()),
        preview_(settings.preview, tiles_, scene.image.window(), mean_),
        pool_(scene, control, scene.accuracy.approximate),
        samples_(scene.accuracy.samples) {}

  /// Throws std::bad_alloc.
  Result<Rendered, Failure> run() {
    Rendered rendered;
    Image& image = rendered.image;
    image_ = &image;
    allocate(image, scene_.image.window(), scene_.output);
    if (samples_ > 1) deviation_.resize(image.rgb.size());
    omitted_.resize(tiles_.count());
    control_.begin(tiles_.count());
    trace(image);
    if (control_.tiles_done() < tiles_.count()) return Failure{Failure::Code::cancelled, "cancelled while tracing"};
    const double brightest = brightest_if_needed(scene_, image.rgb);
    const ErrorContext context{DisplayTransform(scene_.output, brightest), bound_omitted_radiance(scene_, brightest),
                               scene_.output};
    rendered.statistics = pool_.statistics();  // without the samples of features
    rendered.statistics.samples_min = rendered.statistics.samples_max = samples_;
    rendered.error = estimate(image, context);
    estimate_approximation_error<T>(scene_, settings_, control_, context.display, rendered);
    if (control_.cancelled()) return Failure{Failure::Code::cancelled, "cancelled while tracing"};
    return rendered;
  }

 private:
  /// Camera rays per batch: enough to fill packets after most rays have escaped, few enough for the L2 cache. A batch
  /// has all samples of some pixels, or some samples of as many pixels as a packet has lanes.
  static constexpr std::uint32_t batch_rays = 4096, batch_pixels_min = lanes;
  /// A penumbra with 16 stratified points per pixel has a standard error of at most about 3 % of the light.
  static constexpr std::uint32_t light_points_min = 16;
  /// At most about one feature for 512 samples, so that they take little time.
  static constexpr std::size_t samples_per_feature = 512, features_min = 4;

  /// Sums over a pixel's samples. Layers are separate, since few scenes have any.
  struct Sums {
    PixelAccumulator radiance, half;
    OmittedRadiance omitted;
  };

  void trace(Image& image) {
    const PreviewTiles::Open open(preview_);
    for_each_tile(tiles_.count(), settings_.threads, [&](std::uint64_t index) {
      if (control_.cancelled()) return;
      typename TracerPool<T>::Lease tracer(pool_);
      if (trace_tile(index, *tracer, image)) control_.finish_tile();
    });
  }

  /// Returns false if cancelled. The tile is published to the preview by locking it once it is complete.
  bool trace_tile(std::uint64_t index, T& tracer, Image& image) {
    const std::vector<Pixel> pixels = tiles_.pixels(index);
    const std::size_t at_once = std::max(batch_pixels_min, batch_rays / samples_);
    std::vector<OmittedSample> omitted;
    for (std::span<const Pixel> left = pixels; !left.empty(); left = left.subspan(std::min(at_once, left.size())))
      if (!trace_pixels(left.first(std::min(at_once, left.size())), tracer, image, omitted)) return false;
    omitted_[index] = std::vector<OmittedSample>(omitted.begin(), omitted.end());  // without spare capacity
    PreviewTiles::Tile tile(preview_, index);
    const std::lock_guard lock(tile);
    return true;
  }

  bool trace_pixels(std::span<const Pixel> pixels, T& tracer, Image& image, std::vector<OmittedSample>& omitted) {
    std::array<Sums, batch_pixels_min> partial;  // of pixels with more samples than a batch
    std::array<LayerAccumulator, batch_pixels_min> partial_layers;
    const std::uint32_t at_once = std::max(1u, batch_rays / static_cast<std::uint32_t>(pixels.size()));
    for (std::uint32_t first = 0, last = 0; first < samples_; first = last) {
      last = first + std::min(at_once, samples_ - first);
      fill(tracer.batch(), scene_, pixels, {first, last, samples_});
      tracer.batch().light_points = (light_points_min + samples_ - 1) / samples_;
      if (!tracer.trace()) return false;
      if (samples_ == 1) write_each(pixels, tracer, image, omitted);
      const Part part{pixels.size(), first, last == samples_};
      if (samples_ > 1)
        accumulate(part, tracer, partial,
                   [&](std::size_t i, const Sums& sums) { write(sums, tiles_.place(pixels[i]), image, omitted); });
      if (scene_.needs.layers)
        accumulate(part, tracer, partial_layers,
                   [&](std::size_t i, const LayerAccumulator& sums) { sums.write(image, tiles_.place(pixels[i])); });
    }
    return true;
  }

  /// Writes pixels with one sample each, without sums.
  void write_each(std::span<const Pixel> pixels, const T& tracer, Image& image,
                  std::vector<OmittedSample>& omitted_samples) const {
    const std::vector<Color>& radiance = tracer.radiance();
    const std::vector<OmittedRadiance>& omitted = tracer.omitted();
    const Tiles tiles = tiles_;  // local copies, read once and not for each pixel
    float* const film = image.rgb.data();
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const Color& sample = radiance[i];
      if (!finite(sample)) continue;  // counted by the tracer; the pixel stays black
      write_color(film + 3 * tiles.place(pixels[i]), sample);
    }
    for (std::size_t i = 0; i < omitted.size(); ++i)
      if (finite(radiance[i])) add_omitted(omitted[i], tiles_.place(pixels[i]), omitted_samples);
  }

  /// Batch of some samples of all pixels, the first sample of all pixels first.
  struct Part {
    std::size_t pixels;
    std::uint32_t first;  ///< index of the first sample
    bool last;
  };
  /// Accumulates the batch's samples of each pixel; calls write(i, sums) after the last part.
  template <class Sum, class Write>
  void accumulate(const Part& part, const T& tracer, std::array<Sum, batch_pixels_min>& partial,
                  const Write& write) const {
    const std::size_t samples = tracer.radiance().size();
    for (std::size_t i = 0; i < part.pixels; ++i) {
      Sum sums;
      if (part.first > 0) sums = partial[i];
      std::uint32_t index = part.first;
      for (std::size_t sample = i; sample < samples; sample += part.pixels, ++index)
        if (finite(tracer.radiance()[sample])) add_sample(tracer, sample, index, sums);  // others are counted
      if (part.last) {
        write(i, sums);
      } else {
        partial[i] = sums;
      }
    }
  }

  void add_sample(const T& tracer, std::size_t sample, std::uint32_t /*index*/, LayerAccumulator& sums) const {
    sums.add(tracer.gbuffer(), sample);
  }
  /// The first half of a pixel's sequence is stratified by itself, and so is the second.
  void add_sample(const T& tracer, std::size_t sample, std::uint32_t index, Sums& sums) const {
    const Color& radiance = tracer.radiance()[sample];
    sums.radiance.add(radiance);
    if (index < samples_ / 2) sums.half.add(radiance);
    if (!tracer.omitted().empty()) sums.omitted += tracer.omitted()[sample];
  }

  void write(const Sums& sums, std::size_t at, Image& image, std::vector<OmittedSample>& omitted) {
    sums.radiance.write(image.rgb.data() + 3 * at);
    if (!deviation_.empty()) sums.radiance.write_deviation(sums.half, deviation_.data() + 3 * at);
    add_omitted(sums.omitted * (1.0f / static_cast<float>(samples_)), at, omitted);
  }

  static void add_omitted(const OmittedRadiance& radiance, std::size_t at, std::vector<OmittedSample>& omitted) {
    if (radiance.depth + radiance.cutoff + radiance.culled > 0)
      omitted.push_back({static_cast<std::uint32_t>(at), radiance});
  }

  /// Also samples features that the pixels may have missed.
  ErrorEstimate estimate(Image& image, const ErrorContext& context) {
    const InParallel in_parallel = [&](std::uint64_t count, const std::function<void(std::uint64_t)>& work) {
      for_each_tile(count, settings_.threads, work);
    };
    const std::vector<SubpixelFeature> features =
        find_subpixel_features(scene_, features_min + image.rgb.size() / 3 * samples_ / samples_per_feature);
    const std::vector<Color> radiance =
        sample_features(std::span(features), scene_, pool_, in_parallel, [this] { return control_.cancelled(); });
    UniformPixels pixels{image.rgb, deviation_, image.width, samples_};
    const std::vector<MissedFeature> missed =
        missed_features(features, radiance, pixels, scene_.image.window(), context.display);
    pixels.missed = missed;
    pixels.indirect = scene_.needs.reflection || scene_.needs.refraction;
    ErrorEstimate error = measure_uniform_errors(image, pixels, omitted_, context, in_parallel);
    error.bounded = context.bound.bounded || (error.depth == 0 && error.cutoff == 0);
    error.target = scene_.accuracy.target();
    error.tile_target = scene_.accuracy.tile_target();
    error.target_met = targets_reached(error);
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
  PreviewTiles preview_;
  TracerPool<T> pool_;
  std::uint32_t samples_;
  std::vector<float> deviation_;                     ///< standard deviation of each pixel's mean, three channels
  std::vector<std::vector<OmittedSample>> omitted_;  ///< by tile
};

}  // namespace tracer
