#pragma once
/// Textures as heights and as normals of a surface.

#include "tracer/src/textures/texture.h"

namespace tracer {

/// Mean of the channels' slopes along u and v of the surface, per unit of them: the difference over what is covered,
/// which is the slope of the mean over it; where nothing is, over the finest thing that the texture has: one of a
/// image's texels, a thousandth of a pattern's smallest cell.
Vec2 height_slope(const Texture& texture, const Vec2& uv, const Vec2& width, const ImageMap* image);

/// What a colour means as a normal, in the frame (dp/du, dp/dv, out). Not unit; zero where it means none.
inline Vec3 tangent_normal(const Color& color) { return {2 * color.r - 1, 2 * color.g - 1, 2 * color.b - 1}; }

}  // namespace tracer
