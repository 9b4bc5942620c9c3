#pragma once
/// Finds primitives thinner than two pixels by projecting their bounds, so that sampling can target them.

#include <vector>

#include "tracer/src/compiled/compiled_scene.h"

namespace tracer {

struct SubpixelFeature {
  std::uint32_t x = 0, y = 0;  ///< pixel of the full image
  Vec2 at;                     ///< position in the pixel
  float share = 0;             ///< approximate fraction of the pixel that the primitive covers
};

/// Features of spheres and quadrics in the image's window, about one per pixel along their length. Visibility is not
/// tested. If there are more than about `count_max` primitives, every n-th is used. Triangles are left out: the samples
/// of a mesh also find neighboring triangles.
std::vector<SubpixelFeature> find_subpixel_features(const CompiledScene& scene, std::size_t count_max);

}  // namespace tracer
