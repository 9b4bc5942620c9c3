#pragma once
/// Parts of the scene that are so thin that samples may miss them, found by projecting bounds, and sampled one by one.

#include <algorithm>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "tracer/src/integrators/tracer.h"
#include "tracer/src/sampling/camera_samples.h"
#include "tracer/src/sampling/tiles.h"

namespace tracer {

/// A primitive or a few connected triangles thinner than two pixels.
struct SubpixelFeature {
  std::uint32_t x = 0, y = 0;  ///< pixel of the full image
  Vec2 at;                     ///< position in the pixel
  float share = 0;             ///< approximate fraction of the pixel that it covers
  float count = 1;             ///< features that it stands for
};

/// Features in the image's window, about one per pixel along their length: spheres, quadrics and few connected
/// triangles. Larger meshes are left out: their samples also find neighboring triangles. Visibility is not tested. If
/// there are more than about `count_max` candidates, every n-th is used and stands for n. Triangles are searched in
/// scenes that have few of them for an image of this many pixels, so that the search takes little time. `indirect`:
/// also where plane mirrors show them and where lights cast their shadows onto plane surfaces, if there are not too
/// many, and where mirror balls show the sun of an environment.
std::vector<SubpixelFeature> find_subpixel_features(const CompiledScene& scene, std::size_t count_max,
                                                    bool indirect = false);

/// Radiance of a feature without a sample: not a number.
inline constexpr Color unknown_radiance{std::numeric_limits<double>::quiet_NaN(), 0, 0};

/// Radiance of one sample in the middle of each feature; unknown where `stop` was true or the tracer cancelled.
inline std::vector<Color> sample_features(std::span<const SubpixelFeature> features, const CompiledScene& scene,
                                          TracerPool<>& pool, const InParallel& in_parallel,
                                          const std::function<bool()>& stop) {
  constexpr std::size_t at_once = 1024;
  std::vector<Color> radiance(features.size(), unknown_radiance);
  in_parallel((features.size() + at_once - 1) / at_once, [&](std::uint64_t block) {
    if (stop()) return;
    const std::size_t first = block * at_once, count = std::min(at_once, features.size() - first);
    const auto tracer = pool.lease();
    Batch& batch = (*tracer).batch();
    batch.clear();
    batch.light_points = 1;
    for (const SubpixelFeature& feature : features.subspan(first, count)) {
      Sample sample = uniform_sample(scene, feature.x, feature.y, 0, 1);
      sample.at = feature.at;
      sample.share = 0;  // a point sample, without filtered textures
      push(batch, scene, sample);
    }
    if (!(*tracer).trace()) return;
    std::copy_n((*tracer).radiance().begin(), count, radiance.begin() + static_cast<std::ptrdiff_t>(first));
  });
  return radiance;
}

}  // namespace tracer
