#pragma once
/// Things too small for a pixel's samples to meet: where they are is known, since the scene is.

#include <vector>

#include "tracer/src/compiled/compiled_scene.h"

namespace tracer {

/// A place to look at because something is there.
struct SubpixelFeature {
  std::uint32_t x = 0, y = 0;  ///< pixel of the full image
  Vec2 at;                     ///< in the pixel
  float share = 0;             ///< of the pixel that the thing covers, about
};

/// One for each sphere or quadric thinner than two pixels, along its length one a pixel; in the image's window.
/// Whether it can be seen from the camera is for the scout to tell. At most about `most` of them: of more things than
/// that every so many. Triangles have none: neighbours in a mesh stand in for one another.
std::vector<SubpixelFeature> subpixel_features(const CompiledScene& scene, std::size_t most);

}  // namespace tracer
