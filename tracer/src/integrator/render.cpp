#include "tracer/render.h"

#include <mutex>
#include <new>

#include "tracer/src/integrator/parallel.h"
#include "tracer/src/integrator/pixel_sum.h"
#include "tracer/src/integrator/wavefront.h"
#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

constexpr std::uint32_t tile_side = 32;

/// Camera rays traced together: enough to fill packets after most have missed, few enough to stay in the second-level
/// cache.
constexpr std::uint32_t batch_rays = 4096;

PixelWindow tile_at(const PixelWindow& window, std::uint64_t index) {
  const std::uint32_t columns = std::max(1u, (window.width() + tile_side - 1) / tile_side);
  const auto x = static_cast<std::uint32_t>(index % columns) * tile_side;
  const auto y = static_cast<std::uint32_t>(index / columns) * tile_side;
  return {window.x0 + x, window.y0 + y, window.x0 + std::min(x + tile_side, window.width()),
          window.y0 + std::min(y + tile_side, window.height())};
}

std::uint64_t tile_count(const PixelWindow& window) {
  const std::uint64_t columns = (window.width() + tile_side - 1) / tile_side;
  const std::uint64_t rows = (window.height() + tile_side - 1) / tile_side;
  return columns * rows;
}

struct Pixel {
  std::uint32_t x, y;
};

/// The tile's pixels in blocks of 4 x 4: a packet of 16 camera rays then covers a square.
std::vector<Pixel> block_order(const PixelWindow& tile) {
  std::vector<Pixel> pixels;
  for (std::uint32_t by = tile.y0; by < tile.y1; by += 4)
    for (std::uint32_t bx = tile.x0; bx < tile.x1; bx += 4)
      for (std::uint32_t y = by; y < std::min(by + 4, tile.y1); ++y)
        for (std::uint32_t x = bx; x < std::min(bx + 4, tile.x1); ++x) pixels.push_back({x, y});
  return pixels;
}

/// Camera rays of samples [first, last) of every pixel, sample by sample.
Batch camera_rays(const CompiledScene& scene, const std::vector<Pixel>& pixels, std::uint32_t first,
                  std::uint32_t last) {
  Batch batch;
  batch.samples.reserve(pixels.size() * (last - first));
  for (std::uint32_t s = first; s < last; ++s)
    for (const Pixel& pixel : pixels) {
      const std::uint64_t index = static_cast<std::uint64_t>(pixel.y) * scene.image.width + pixel.x;
      const std::uint64_t key = pixel_key(index, scene.accuracy.seed);
      const Vec2 at = pixel_sample(index, s, scene.accuracy.samples, scene.accuracy.seed);
      const double x = pixel.x + at.x, y = pixel.y + at.y;
      const TraceCamera::Aim aim = scene.needs.lens
                                       ? scene.camera.aim(x, y, lens_sample(key, s, scene.accuracy.samples))
                                       : scene.camera.aim(x, y);
      batch.camera.push(aim.origin, aim.direction, {1, 1, 1}, static_cast<std::uint32_t>(batch.samples.size()), {}, 0,
                        Media::camera(scene));
      if (scene.needs.filtered_textures) batch.camera.widen(camera_cone(scene, aim.direction));
      batch.samples.push_back({key, s});
    }
  return batch;
}

/// Traces one tile into `image`. False: cancelled.
template <class Model>
bool render_tile(const CompiledScene& scene, const PixelWindow& tile, Wavefront<Model>& wavefront, Image& image) {
  const std::vector<Pixel> pixels = block_order(tile);
  const auto pixel_count = static_cast<std::uint32_t>(pixels.size());
  std::vector<PixelSum> sums(pixel_count);
  std::vector<LayerSum> layers(scene.needs.layers ? pixel_count : 0);
  const std::uint32_t samples = scene.accuracy.samples;
  const std::uint32_t at_once = std::max(1u, batch_rays / pixel_count);
  for (std::uint32_t first = 0; first < samples; first += std::min(at_once, samples - first)) {
    const std::uint32_t last = first + std::min(at_once, samples - first);
    if (!wavefront.trace(camera_rays(scene, pixels, first, last))) return false;
    const std::vector<Color>& radiance = wavefront.radiance();
    for (std::size_t i = 0; i < radiance.size(); ++i) {
      if (!finite(radiance[i])) continue;  // counted by the wavefront
      sums[i % pixel_count].add(radiance[i]);
      if (scene.needs.layers) layers[i % pixel_count].add(wavefront.first_hits(), i);
    }
  }
  for (std::uint32_t i = 0; i < pixel_count; ++i) {
    const PixelWindow window = scene.image.window();
    const std::size_t at = static_cast<std::size_t>(pixels[i].y - window.y0) * image.width + (pixels[i].x - window.x0);
    sums[i].write(image, at);
    if (scene.needs.layers) layers[i].write(image, at);
  }
  return true;
}

/// Tracers with their scratch memory, one for each thread that wants one at the same time.
template <class Model>
class WavefrontPool {
 public:
  WavefrontPool(const CompiledScene& scene, const RenderControl& control) : scene_(scene), control_(control) {}

  std::unique_ptr<Wavefront<Model>> take() {
    const std::lock_guard lock(mutex_);
    if (idle_.empty()) return std::make_unique<Wavefront<Model>>(scene_, control_);
    std::unique_ptr<Wavefront<Model>> wavefront = std::move(idle_.back());
    idle_.pop_back();
    return wavefront;
  }
  void give_back(std::unique_ptr<Wavefront<Model>> wavefront) {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(wavefront));
  }
  [[nodiscard]] const std::vector<std::unique_ptr<Wavefront<Model>>>& idle() const { return idle_; }

 private:
  const CompiledScene& scene_;
  const RenderControl& control_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Wavefront<Model>>> idle_;
};

void add(RenderStatistics& total, const RenderStatistics& part) {
  total.rays.camera += part.rays.camera;
  total.rays.shadow += part.rays.shadow;
  total.rays.reflection += part.rays.reflection;
  total.rays.refraction += part.rays.refraction;
  total.samples += part.samples;
  total.non_finite += part.non_finite;
  total.spared_shadow_rays += part.spared_shadow_rays;
  total.spared_light += part.spared_light;
  total.cut_branches += part.cut_branches;
  total.truncated_branches += part.truncated_branches;
}

template <class Model>
Result<Rendered, Failure> render_with(const CompiledScene& scene, const RenderSettings& settings,
                                      RenderControl& control) {
  try {
    Rendered rendered;
    Image& image = rendered.image;
    const PixelWindow window = scene.image.window();
    allocate(image, window, scene.output);
    const std::uint64_t tiles = tile_count(window);
    control.begin(tiles);
    WavefrontPool<Model> pool(scene, control);
    for_each_tile(tiles, settings.threads, [&](std::uint64_t index) {
      if (control.cancelled()) return;
      auto wavefront = pool.take();
      const bool done = render_tile(scene, tile_at(window, index), *wavefront, image);
      pool.give_back(std::move(wavefront));
      if (done) control.finish_tile();
    });
    if (control.tiles_done() < tiles) return Failure{Failure::Code::cancelled, "cancelled while tracing"};
    for (const auto& wavefront : pool.idle()) add(rendered.statistics, wavefront->statistics());
    return rendered;
  } catch (const std::bad_alloc&) {
    return Failure{Failure::Code::out_of_memory, "no memory for the picture or its rays"};
  }
}

}  // namespace

Result<Rendered, Failure> render(const CompiledScene& scene, const RenderSettings& settings, RenderControl& control) {
  if (suffices<ClassicModel>(scene.needs)) return render_with<ClassicModel>(scene, settings, control);
  return render_with<FullModel>(scene, settings, control);
}

}  // namespace tracer
