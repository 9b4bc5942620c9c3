#pragma once
/// The kinds of pixels in which estimates of error fail in their own ways.

#include <array>
#include <string_view>
#include <vector>

#include "tests/honesty/corpus.h"

namespace honesty {

enum class Stratum {
  edge,      ///< what camera rays hit changes within the pixel: object, side or texture's colour
  specular,  ///< no edge, and some of its light came through a mirror or glass
  penumbra,  ///< none of these, and what is in shadow changes within the pixel: soft shadows and the rims of hard ones
  smooth,    ///< nothing of all that
};

inline constexpr std::array<std::string_view, 4> stratum_names{"edge", "specular", "penumbra", "smooth"};

/// Each pixel's, row 0 on top. Judged from 16 points of each pixel: their first hits, and what becomes of the image
/// without bounces and without shadows.
std::vector<Stratum> strata_of(const Case& scene, std::uint32_t threads = 0);

}  // namespace honesty
