#include "tests/honesty/strata.h"

#include <algorithm>
#include <cmath>

namespace honesty {

using namespace tracer;

namespace {

constexpr std::uint32_t fine = 4;  // points along each side of a pixel

/// The scene in as many times the pixels, each a single look: at its middle, but through anywhere of a lens.
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

/// The least and the largest of what is offered.
struct Range {
  double low = INFINITY, high = -INFINITY;
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  [[nodiscard]] double width() const { return high - low; }
};

class Judge {
 public:
  Judge(const Case& scene, std::uint32_t threads) {
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

  [[nodiscard]] Stratum at(std::uint32_t x, std::uint32_t y) const {
    std::array<Range, 3> normal, albedo;
    Range object, taken;
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
        taken.add(static_cast<double>(unshadowed_.rgb[3 * at + 1]) - full_.rgb[3 * at + 1]);
      }
    // A unit normal that turns by half its length is a corner; a texture's colour that changes by a tenth an edge in
    // it.
    const auto more_than = [](double limit) { return [limit](const Range& range) { return range.width() > limit; }; };
    if (object.width() > 0 || std::any_of(normal.begin(), normal.end(), more_than(0.5)) ||
        std::any_of(albedo.begin(), albedo.end(), more_than(0.1)))
      return Stratum::edge;
    if (bounced > 0) return Stratum::specular;
    return taken.width() > 0.02 * brightest ? Stratum::penumbra : Stratum::smooth;
  }

 private:
  Image full_, direct_, unshadowed_;
};

}  // namespace

std::vector<Stratum> strata_of(const Case& scene, std::uint32_t threads) {
  const Judge judge(scene, threads);
  std::vector<Stratum> strata;
  for (std::uint32_t y = 0; y < judge.height(); ++y)
    for (std::uint32_t x = 0; x < judge.width(); ++x) strata.push_back(judge.at(x, y));
  return strata;
}

}  // namespace honesty
