#pragma once
/// Ranges of surface colors over the hits of a bundle of rays.

#include <array>
#include <vector>

#include "tracer/src/certify/surface_patch.h"

namespace tracer {

/// Ranges of the channels of a color.
using ColorInterval = std::array<Interval, 3>;

inline ColorInterval interval_of(const Color& color) {
  return {{{color.r, color.r}, {color.g, color.g}, {color.b, color.b}}};
}
inline ColorInterval hull(const ColorInterval& a, const ColorInterval& b) {
  return {hull(a[0], b[0]), hull(a[1], b[1]), hull(a[2], b[2])};
}

/// Range of the texture over its whole domain.
ColorInterval texture_range(const Texture& texture, const ImageMap* image);

/// Range of a color of the patch's material, for any fraction of the footprint of a pixel whose rays have the width
/// `width` there. `textures` are the ranges of the scene's textures.
ColorInterval color_range(const CompiledScene& scene, const std::vector<ColorInterval>& textures,
                          const ColorOrTexture& color, const SurfacePatch& patch, const RayBundle& rays, double width);

/// The same over the whole texture.
inline ColorInterval color_range(const std::vector<ColorInterval>& textures, const ColorOrTexture& color) {
  const auto* const id = std::get_if<TextureId>(&color);
  return id != nullptr ? textures[id->index] : interval_of(std::get<Color>(color));
}

}  // namespace tracer
