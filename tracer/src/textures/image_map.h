#pragma once
/// An image texture: mip maps and filtered lookups.

#include <cstdint>
#include <vector>

#include "tracer/image.h"
#include "tracer/src/math/vec.h"

namespace tracer {

/// Wrap modes per axis.
struct Wraps {
  Texture::Wrap u = Texture::Wrap::repeat, v = Texture::Wrap::repeat;
};

class ImageMap {
 public:
  /// `image` is linear. Each mip level is the box-filtered previous one at half its size, rounded down; for odd sizes
  /// texels are weighted by area, so every level has the image's mean (Williams 1983, "Pyramidal Parametrics"; Guthe,
  /// Heckbert 2005 for odd sizes).
  explicit ImageMap(Image image);

  /// The texel that contains (u, v).
  [[nodiscard]] Color nearest(const Vec2& uv, const Wraps& wraps) const;
  /// Bilinear interpolation in the full image.
  [[nodiscard]] Color bilinear(const Vec2& uv, const Wraps& wraps) const {
    return bilinear(levels_.front(), uv, wraps);
  }
  /// Trilinear interpolation between the two levels whose texel size is closest to the footprint `width`, selected by
  /// its larger side in texels.
  [[nodiscard]] Color trilinear(const Vec2& uv, const Vec2& width, const Wraps& wraps) const;

  [[nodiscard]] const std::vector<Image>& levels() const { return levels_; }  ///< row 0 on top
  [[nodiscard]] std::uint64_t memory_bytes() const;

 private:
  static Color bilinear(const Image& level, const Vec2& uv, const Wraps& wraps);

  std::vector<Image> levels_;  ///< from the full image to one texel
};

}  // namespace tracer
