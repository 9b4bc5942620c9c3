#include "tracer/src/textures/texture.h"

namespace tracer {
namespace {

/// Minimum step of the finite difference: below it there is only interpolation, whose slope is discontinuous. For an
/// image, a texel of the mip level in use.
Vec2 finest(const Texture& texture, const Vec2& covered, const ImageMap* image) {
  if (image != nullptr) {
    const Image& level = image->levels().front();
    const double texels = std::max({covered.x * level.width, covered.y * level.height, 1.0});
    return {texels / level.width, texels / level.height};
  }
  const auto* noise = std::get_if<NoiseTexture>(&texture.pattern);
  const double cell = noise != nullptr ? std::ldexp(1.0, 1 - static_cast<int>(noise->octaves)) : 1;
  return {cell * 0x1p-10, cell * 0x1p-10};
}

}  // namespace

Vec2 height_slope(const Texture& texture, const Vec2& uv, const Vec2& width, const ImageMap* image) {
  const Lookup here = lookup(texture, uv, width);
  const Vec2 least = finest(texture, here.covered, image);
  const auto height = [&](const Vec2& at) {
    const Color color = texture_color(texture, Lookup{at, here.covered}, image, {texture.wrap, texture.wrap});
    return (color.r + color.g + color.b) / 3;
  };
  // Divided by the step after rounding, which is 0 beyond 2^53, where coordinates have no fraction.
  const auto slope = [&](const Vec2& low, const Vec2& high, double step) {
    return step > 0 ? (height(high) - height(low)) / step : 0;
  };
  const double half_u = std::max(here.covered.x, least.x) / 2, half_v = std::max(here.covered.y, least.y) / 2;
  const Vec2 left{here.at.x - half_u, here.at.y}, right{here.at.x + half_u, here.at.y};
  const Vec2 low{here.at.x, here.at.y - half_v}, high{here.at.x, here.at.y + half_v};
  return {slope(left, right, right.x - left.x) * texture.scale.x, slope(low, high, high.y - low.y) * texture.scale.y};
}

}  // namespace tracer
