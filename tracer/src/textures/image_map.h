#pragma once
/// An image as a texture: its pyramid of halves, and lookups in it.

#include <array>
#include <cstdint>
#include <vector>

#include "tracer/image.h"
#include "tracer/src/math/vec.h"

namespace tracer {

/// How a lookup goes on beyond [0,1], per axis.
struct Wraps {
  Texture::Wrap u = Texture::Wrap::repeat, v = Texture::Wrap::repeat;
};

class ImageMap {
 public:
  /// Linear light. Each level of the pyramid is the box-filtered one below at half its size, rounded down; where that
  /// is odd, texels share the ones between them by area, so every level's mean is the image's (Williams 1983,
  /// "Pyramidal Parametrics"; Guthe, Heckbert 2005 for odd sizes).
  explicit ImageMap(Image image);

  /// The texel that (u, v) is in.
  [[nodiscard]] Color nearest(const Vec2& uv, const Wraps& wraps) const;
  /// Between the centres of the four texels around (u, v) of the full image.
  [[nodiscard]] Color bilinear(const Vec2& uv, const Wraps& wraps) const {
    return bilinear(levels_.front(), uv, wraps);
  }
  /// Between the two levels whose texels are next in size to `width`, the part of the image that is covered: by the
  /// larger of its two sides, in texels.
  [[nodiscard]] Color trilinear(const Vec2& uv, const Vec2& width, const Wraps& wraps) const;

  [[nodiscard]] const std::vector<Image>& levels() const { return levels_; }  ///< row 0 on top
  [[nodiscard]] std::uint64_t memory_bytes() const;

 private:
  static Color bilinear(const Image& level, const Vec2& uv, const Wraps& wraps);

  std::vector<Image> levels_;  ///< from the full image to one texel
};

}  // namespace tracer
