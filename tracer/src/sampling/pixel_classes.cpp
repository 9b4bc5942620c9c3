#include "tracer/src/sampling/pixel_classes.h"

#include <algorithm>
#include <bit>

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

/// Differences of the pixels of a row from their neighbors on the right and below; none beyond the image.
class RowDifferences {
 public:
  struct Difference {
    float squared = 0;  ///< squared difference of the code values, summed over the channels
    std::uint8_t edge = 0;
  };
  struct Column {
    Difference right, down_left, down, down_right;
  };
  /// Columns [first, last) of a row; on both sides is another without neighbors.
  RowDifferences(std::size_t first, std::size_t last) : first_(first), columns_(last - first + 2) {}

  void set(const PilotImage& pilots, std::size_t y) {
    const std::size_t width = pilots.width, last = first_ + columns_.size() - 2;
    const bool has_below = y + 1 < pilots.height;
    for (std::size_t x = first_; x < last; ++x) {
      const std::size_t place = y * width + x;
      const bool has_right = x + 1 < width;
      Column& column = columns_[x - first_ + 1];
      column.right = has_right ? between(pilots, place, place + 1) : Difference{};
      column.down_left = x > 0 && has_below ? between(pilots, place, place + width - 1) : Difference{};
      column.down = has_below ? between(pilots, place, place + width) : Difference{};
      column.down_right = has_right && has_below ? between(pilots, place, place + width + 1) : Difference{};
    }
  }
  /// Column x, from first - 1 to last.
  [[nodiscard]] const Column& at(std::size_t x) const { return columns_[x + 1 - first_]; }

 private:
  static Difference between(const PilotImage& pilots, std::size_t a, std::size_t b) {
    float squared = 0;
    for (const auto& channel : pilots.code_values) squared += (channel[a] - channel[b]) * (channel[a] - channel[b]);
    return {squared, static_cast<std::uint8_t>(differ(pilots.signatures[a], pilots.signatures[b]) ? 1 : 0)};
  }

  std::size_t first_;
  std::vector<Column> columns_;
};

float squared_laplacian(const PilotImage& pilots, std::size_t x, std::size_t y) {
  const std::size_t width = pilots.width, own = y * width + x, left = own - (x > 0 ? 1 : 0),
                    right = own + (x + 1 < width ? 1 : 0), up = own - (y > 0 ? width : 0),
                    down = own + (y + 1 < pilots.height ? width : 0);
  float squared = 0;
  for (const auto& channel : pilots.code_values) {
    const float laplacian = 4 * channel[own] - channel[left] - channel[right] - channel[up] - channel[down];
    squared += laplacian * laplacian;
  }
  return squared;
}

/// True if the pilot or one of its neighbors shows something in mirrors or through glass.
bool is_mirrored(const PilotImage& pilots, std::size_t x, std::size_t y) {
  for (std::size_t row = y - std::min<std::size_t>(y, 1); row < std::min<std::size_t>(y + 2, pilots.height); ++row)
    for (std::size_t at = x - std::min<std::size_t>(x, 1); at < std::min<std::size_t>(x + 2, pilots.width); ++at)
      if (pilots.signatures[row * pilots.width + at].secondary != 0) return true;
  return false;
}

}  // namespace

ByClass<ClassCount> classify(const PilotImage& pilots, const PixelWindow& window, std::span<PixelClass> classes) {
  ByClass<ClassCount> counts{};
  const std::size_t width = pilots.width, first = window.x0 - (window.x0 > 0 ? 1 : 0),
                    last = std::min<std::size_t>(width, window.x1 + 1);
  RowDifferences above(first, last), row(first, last);
  if (window.y0 > 0) above.set(pilots, window.y0 - 1);
  for (std::size_t y = window.y0; y < window.y1; ++y, std::swap(above, row)) {
    row.set(pilots, y);
    for (std::size_t x = window.x0; x < window.x1; ++x) {
      const std::size_t place = y * width + x;
      const auto &own = row.at(x), &up = above.at(x);
      const std::array sides{row.at(x - 1).right, own.right, up.down, own.down},
          corners{above.at(x - 1).down_right, above.at(x + 1).down_left, own.down_left, own.down_right};
      float contrast = 0;
      std::size_t sides_differ = 0, corners_differ = 0;
      for (std::size_t i = 0; i < sides.size(); ++i) {
        contrast = pilots.noisy ? contrast + (sides[i].squared + corners[i].squared) / 24
                                : std::max({contrast, sides[i].squared / 3, corners[i].squared / 3});
        sides_differ += sides[i].edge;
        corners_differ += corners[i].edge;
      }
      const float curvature = pilots.noisy ? 3 * contrast : squared_laplacian(pilots, x, y) / (24 * 24);
      // Fewer rows or columns do not show the curvature across them.
      const bool smooth = sides_differ + corners_differ == 0 && pilots.width > 2 && pilots.height > 2;
      float missed = pilots.features.empty() ? -1 : pilots.features[place];
      if (const float detail = pilots.signatures[place].detail; detail > 0)
        missed = std::max(missed, 3 * detail * detail);
      classes[place] =
          missed >= 0 && (pilots.noisy ? missed / 3 > contrast : smooth || missed / 3 > contrast / 8)
              ? class_of(PixelKind::feature, missed / 3)
          : smooth ? class_of(pilots.signatures[place].secondary != 0 ? PixelKind::reflecting : PixelKind::smooth,
                              16 * curvature / 3)
                   : class_of(static_cast<PixelKind>(std::min<std::size_t>(sides_differ, 3) +
                                                     (is_mirrored(pilots, x, y) ? 4 : 0)),
                              contrast);
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
