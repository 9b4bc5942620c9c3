#include <algorithm>
#include <functional>
#include <iterator>
#include <mutex>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "tracer/src/parallel/parallel_for.h"
#include "tracer/src/sampling/image_error.h"
#include "tracer/src/sampling/part_round.h"
#include "tracer/src/sampling/sampler.h"
#include "tracer/src/sampling/tiles.h"
#include "tracer/src/sampling/truncation.h"
#include "tracer/src/sampling/uniform_tracer.h"

namespace tracer {
namespace {

class UniformSampler {
 public:
  UniformSampler(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control,
                 const MakeTracer& make)
      : scene_(scene),
        settings_(settings),
        control_(control),
        film_(scene, scene.image.window()),
        preview_(settings.preview, film_.tiles, scene.image.window(), mean_),
        pool_(make, scene, control, scene.accuracy.approximate),
        samples_(scene.accuracy.samples) {}

  Result<Rendered, Failure> run() {
    control_.begin(film_.tiles.count());
    trace();
    if (control_.cancelled() || control_.tiles_done() < film_.tiles.count())
      return Failure{Failure::Code::cancelled, "cancelled while tracing"};
    Image& image = film_.image;
    const ErrorContext context = error_context(scene_, image.rgb);
    Rendered rendered;
    rendered.statistics = pool_.statistics();  // without the samples of features
    rendered.statistics.samples_min = rendered.statistics.samples_max = samples_;
    const TruncationError truncation = TruncationLooks(context_, mean_).measure(film_.omitted, context);
    rendered.error = estimate(image, truncation, context);
    truncation.add_to(image.layers.error);
    if (scene_.accuracy.approximate.any() || filtering_changes_means(scene_)) {
      ApproximationLooks looks(pool_.make(), scene_, settings_, control_, context.display, mean_);
      const ApproximationError approximation = scene_.accuracy.approximate.any()
                                                   ? looks.measure(Deadline{settings_, {}, 1}, rendered.statistics)
                                                   : looks.measure_filters(filter_weights(context.display));
      add_approximation(rendered.error, approximation.error, image.rgb.size() / 3);
      approximation.count_in(rendered);
    }
    truncation.count_in(rendered);
    rendered.error.target_met = targets_reached(rendered.error);
    rendered.image = std::move(image);
    if (control_.cancelled()) return Failure{Failure::Code::cancelled, "cancelled while tracing"};
    return rendered;
  }

 private:
  /// At most about one feature for 512 samples, so that they take little time.
  static constexpr std::size_t samples_per_feature = 512, features_min = 4;

  void trace() {
    const PreviewTiles::Open open(preview_);
    UniformRound round(film_, preview_, samples_);
    if (trace_in_parts(round, context_)) return;
    UniformTracer uniform(scene_, film_);
    for_each_tile(film_.tiles.count(), settings_.threads, [&](std::uint64_t index) {
      if (control_.cancelled()) return;
      const auto tracer = pool_.lease();
      if (!uniform.trace_tile(index, *tracer)) return;
      {
        PreviewTiles::Tile tile(preview_, index);
        const std::lock_guard lock(tile);  // publishes it
      }
      control_.finish_tile();
    });
  }

  /// Also samples features that the pixels may have missed.
  ErrorEstimate estimate(Image& image, const TruncationError& truncation, const ErrorContext& context) {
    const auto in_parallel = [&](auto count, const auto& work) { for_each_tile(count, settings_.threads, work); };
    const std::vector<SubpixelFeature> features =
        find_subpixel_features(scene_, features_min + image.rgb.size() / 3 * samples_ / samples_per_feature);
    const std::vector<Color> radiance =
        sample_features(std::span(features), scene_, pool_, in_parallel, [this] { return control_.cancelled(); });
    UniformPixels pixels{image.rgb, film_.deviation, image.width, samples_};
    const std::vector<MissedFeature> missed =
        missed_features(features, radiance, pixels, scene_.image.window(), context.display);
    pixels.missed = missed;
    pixels.indirect = has_secondary_rays(scene_.needs);
    pixels.noisy = scene_.needs.global_light || scene_.needs.principled;
    ErrorEstimate error = measure_uniform_errors(image, pixels, truncation.error, context, in_parallel);
    error.bounded = scene_.has_bounded_patches() && truncation.bounded;
    error.target = scene_.accuracy.target();
    error.tile_target = scene_.accuracy.tile_target();
    return error;
  }

  /// The variance of each pixel and, so that any pixel may be drawn, the mean of all: textures vary where pixels do.
  std::vector<float> filter_weights(const DisplayTransform& display) {
    UniformVariance variance({film_.image.rgb, film_.deviation, film_.image.width, samples_}, display);
    std::vector<float> weights;
    for (std::size_t y = 0; y < film_.image.height; ++y)
      std::ranges::copy(variance.row(y), std::back_inserter(weights));
    const double mean = std::accumulate(weights.begin(), weights.end(), 0.0) / static_cast<double>(weights.size());
    for (float& weight : weights) weight += mean > 0 ? static_cast<float>(mean) : 1;
    return weights;
  }

  const CompiledScene& scene_;
  const RenderSettings& settings_;
  RenderControl& control_;
  UniformFilm film_;
  const std::function<Color(std::size_t)> mean_ = [this](std::size_t place) {
    const float* const rgb = film_.image.rgb.data() + 3 * place;
    return Color{rgb[0], rgb[1], rgb[2]};
  };
  PreviewTiles preview_;
  TracerPool<> pool_;
  const PartContext context_{scene_, settings_, control_, pool_};
  std::uint32_t samples_;
};

}  // namespace

Result<Rendered, Failure> sample_uniformly(const CompiledScene& scene, const RenderSettings& settings,
                                           RenderControl& control, const MakeTracer& make) {
  return UniformSampler(scene, settings, control, make).run();
}

}  // namespace tracer
