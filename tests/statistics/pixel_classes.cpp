#include "tests/statistics/pixel_classes.h"

#include <algorithm>
#include <cmath>

namespace statistics {

using namespace tracer;

namespace {

constexpr std::uint32_t fine = 4;  // points along each side of a pixel

/// The scene with `fine` x `fine` times the pixels, one sample each (two with a lens).
Scene magnified(const Scene& scene) {
  Scene large = scene;
  large.image.width *= fine;
  large.image.height *= fine;
  if (auto& crop = large.image.crop)
    crop = PixelWindow{crop->x0 * fine, crop->y0 * fine, crop->x1 * fine, crop->y1 * fine};
  large.accuracy = {};
  large.accuracy.samples = scene.camera.aperture > 0 ? 2 : 1;
  large.output = {.layers = {Layer::object_id, Layer::normal, Layer::albedo}};
  for (Texture& texture : large.textures)
    if (texture.filter == Texture::Filter::mipmap) texture.filter = Texture::Filter::bilinear;
  return large;
}

/// Smallest and largest value.
struct Range {
  double low = INFINITY, high = -INFINITY;
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  [[nodiscard]] double width() const { return high - low; }
};

class PixelClassifier {
 public:
  PixelClassifier(const Case& scene, std::uint32_t threads) {
    Scene large = magnified(scene.scene);
    full_ = scenes::render(large, threads, scene.assets).image;
    Scene direct = large;
    direct.accuracy.max_depth = 0;
    direct_ = scenes::render(direct, threads, scene.assets).image;
    for (Light& light : large.lights) light.shadows = false;
    unshadowed_ = scenes::render(large, threads, scene.assets).image;
  }

  [[nodiscard]] std::uint32_t width() const { return full_.width / fine; }
  [[nodiscard]] std::uint32_t height() const { return full_.height / fine; }

  [[nodiscard]] PixelClass at(std::uint32_t x, std::uint32_t y) const {
    std::array<Range, 3> normal, albedo;
    Range object, shadowed;
    double bounced = 0, brightest = 0;
    for (std::uint32_t j = y * fine; j < (y + 1) * fine; ++j)
      for (std::uint32_t i = x * fine; i < (x + 1) * fine; ++i) {
        const std::size_t at = static_cast<std::size_t>(j) * full_.width + i;
        object.add(full_.layers.object_id[at]);
        for (std::size_t c = 0; c < 3; ++c) {
          normal[c].add(full_.layers.normal[3 * at + c]);
          albedo[c].add(full_.layers.albedo[3 * at + c]);
          bounced = std::max(bounced, std::abs(static_cast<double>(full_.rgb[3 * at + c]) - direct_.rgb[3 * at + c]));
          brightest = std::max<double>(brightest, unshadowed_.rgb[3 * at + c]);
        }
        shadowed.add(static_cast<double>(unshadowed_.rgb[3 * at + 1]) - full_.rgb[3 * at + 1]);
      }
    // Edges: the normal changes by half its length, or the albedo by a tenth.
    const auto more_than = [](double limit) { return [limit](const Range& range) { return range.width() > limit; }; };
    if (object.width() > 0 || std::any_of(normal.begin(), normal.end(), more_than(0.5)) ||
        std::any_of(albedo.begin(), albedo.end(), more_than(0.1)))
      return PixelClass::edge;
    if (bounced > 0) return PixelClass::specular;
    return shadowed.width() > 0.02 * brightest ? PixelClass::penumbra : PixelClass::smooth;
  }

 private:
  Image full_, direct_, unshadowed_;
};

}  // namespace

std::vector<PixelClass> classify_pixels(const Case& scene, std::uint32_t threads) {
  const PixelClassifier classifier(scene, threads);
  std::vector<PixelClass> pixel_classes;
  for (std::uint32_t y = 0; y < classifier.height(); ++y)
    for (std::uint32_t x = 0; x < classifier.width(); ++x) pixel_classes.push_back(classifier.at(x, y));
  return pixel_classes;
}

}  // namespace statistics
