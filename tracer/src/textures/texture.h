#pragma once
/// Colours that vary over a surface.

#include <cmath>

#include "tracer/src/math/vec.h"

namespace tracer {

/// Colour of `texture` at the surface coordinates `uv`. floor works on doubles, so no coordinate overflows it.
inline Color texture_color(const Texture& texture, const Vec2& uv) {
  const double u = uv.x * texture.scale.x + texture.offset.x;
  const double v = uv.y * texture.scale.y + texture.offset.y;
  const auto& checker = std::get<CheckerTexture>(texture.pattern);
  const double square = std::floor(u) + std::floor(v);
  const bool even = std::floor(square * 0.5) * 2 == square;
  return checker.colors[even ? 0 : 1];
}

}  // namespace tracer
