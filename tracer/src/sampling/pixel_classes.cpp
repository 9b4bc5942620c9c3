#include "tracer/src/sampling/pixel_classes.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace tracer {
namespace {

std::size_t octave_of(float squared) {
  return std::min<std::size_t>(
      contrast_bins - 1,
      static_cast<std::size_t>(std::bit_width(static_cast<std::uint32_t>(std::min(squared, 1e9F) + 1)) - 1));
}

PixelClass class_of(PixelKind kind, float squared) {
  return static_cast<PixelClass>(static_cast<std::size_t>(kind) * contrast_bins + octave_of(squared));
}

}  // namespace

ByClass<ClassCount> classify(const PilotImage& pilots, const PixelWindow& window, std::span<PixelClass> classes) {
  ByClass<ClassCount> counts{};
  const std::size_t width = pilots.width;
  for (std::size_t y = window.y0; y < window.y1; ++y) {
    const std::size_t up = y > 0 ? width : 0, down = y + 1 < pilots.height ? width : 0;
    for (std::size_t x = window.x0; x < window.x1; ++x) {
      const std::size_t place = y * width + x, left = x > 0 ? 1 : 0, right = x + 1 < width ? 1 : 0;
      const std::array<std::size_t, 8> neighbors{place - left,        place + right,       place - up,
                                                 place + down,        place - up - left,   place - up + right,
                                                 place + down - left, place + down + right};
      const float* const own = &pilots.code_values[3 * place];
      std::size_t sides = 0, corners = 0;
      float contrast = 0;
      std::array<float, 3> laplacian{4 * own[0], 4 * own[1], 4 * own[2]};
      for (std::size_t i = 0; i < neighbors.size(); ++i) {
        const float* const other = &pilots.code_values[3 * neighbors[i]];
        float squared = 0;
        for (std::size_t channel = 0; channel < 3; ++channel) {
          const float difference = own[channel] - other[channel];
          squared += difference * difference;
          if (i < 4) laplacian[channel] -= other[channel];
        }
        contrast = pilots.noisy ? contrast + squared / 24 : std::max(contrast, squared / 3);
        (i < 4 ? sides : corners) += differ(pilots.signatures[place], pilots.signatures[neighbors[i]]) ? 1 : 0;
      }
      const float curvature =
          pilots.noisy
              ? 3 * contrast
              : (laplacian[0] * laplacian[0] + laplacian[1] * laplacian[1] + laplacian[2] * laplacian[2]) / (24 * 24);
      // Fewer rows or columns do not show the curvature across them.
      const bool smooth = sides + corners == 0 && pilots.width > 2 && pilots.height > 2;
      float missed = pilots.features.empty() ? -1 : pilots.features[place];
      if (const float detail = pilots.signatures[place].detail; detail > 0)
        missed = std::max(missed, 3 * detail * detail);
      classes[place] =
          missed >= 0 && (smooth || missed / 3 > contrast / 8) ? class_of(PixelKind::feature, missed / 3)
          : smooth ? class_of(pilots.signatures[place].secondary != 0 ? PixelKind::reflecting : PixelKind::smooth,
                              16 * curvature / 3)
                   : class_of(static_cast<PixelKind>(std::min<std::size_t>(sides, 3)), contrast);
      counts[classes[place]].add({.pixels = 1,
                                  .curvature = curvature,
                                  .slope = 3 * contrast / 12,
                                  .rays = static_cast<double>(pilots.signatures[place].rays),
                                  .missed = std::max(missed, 0.0F)});
    }
  }
  return counts;
}

}  // namespace tracer
