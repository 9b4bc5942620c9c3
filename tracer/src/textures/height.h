#pragma once
/// Textures as bump maps and normal maps.

#include "tracer/src/textures/texture.h"

namespace tracer {

/// Derivatives of the height along u and v of the surface, as finite differences over the footprint; without a
/// footprint over the finest detail of the texture: one texel of an image, a thousandth of a pattern's smallest cell.
Vec2 height_slope(const Texture& texture, const Vec2& uv, const Vec2& width, const ImageMap* image);

/// Normal encoded in a color, in the frame (dp/du, dp/dv, n). Not unit length; zero if the color encodes no direction.
inline Vec3 tangent_normal(const Color& color) { return {2 * color.r - 1, 2 * color.g - 1, 2 * color.b - 1}; }

}  // namespace tracer
