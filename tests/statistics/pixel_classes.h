#pragma once
/// Classes of pixels in which error estimates fail for different reasons.

#include <array>
#include <string_view>
#include <vector>

#include "tests/statistics/scene_corpus.h"

namespace statistics {

enum class PixelClass {
  edge,      ///< the first hits of camera rays differ in object, normal or albedo
  specular,  ///< no edge, and a part of the radiance was reflected or refracted
  penumbra,  ///< neither, and the visibility of lights changes within the pixel, also at hard shadows
  smooth,    ///< all other pixels
};

inline constexpr std::array<std::string_view, 4> pixel_class_names{"edge", "specular", "penumbra", "smooth"};

/// Class of each pixel, row 0 on top, from 16 points of each pixel: their first hits, and the images without bounces
/// and without shadows.
std::vector<PixelClass> classify_pixels(const Case& scene, std::uint32_t threads = 0);

}  // namespace statistics
