#pragma once
/// Evaluation of textures.

#include <memory>

#include "tracer/src/textures/box_filter.h"
#include "tracer/src/textures/image_map.h"
#include "tracer/src/textures/noise.h"

namespace tracer {

/// Mean of the pattern over the rectangle `width` around (u, v), or its value at the point for zero width. floor works
/// on doubles, so no coordinate overflows.
inline Color pattern_color(const CheckerTexture& checker, const Vec2& uv, const Vec2& width, Texture::Wrap) {
  // The sign is separable in u and v, and so is its mean over a rectangle.
  const double sign = alternating_mean(uv.x, width.x) * alternating_mean(uv.y, width.y);
  if (std::abs(sign) == 1) return checker.colors[sign > 0 ? 0 : 1];
  return checker.colors[0] * ((1 + sign) / 2) + checker.colors[1] * ((1 - sign) / 2);
}

inline Color pattern_color(const GradientTexture& gradient, const Vec2& uv, const Vec2& width, Texture::Wrap wrap) {
  const double t = wrapped_mean(wrap, uv.y, width.y);
  return gradient.colors[0] * (1 - t) + gradient.colors[1] * t;
}

inline Color pattern_color(const NoiseTexture& noise, const Vec2& uv, const Vec2& width, Texture::Wrap) {
  const double t = 0.5 + 0.5 * octave_noise(uv.x, uv.y, noise.octaves, std::max(width.x, width.y));
  return noise.colors[0] * (1 - t) + noise.colors[1] * t;
}

/// A point in texture coordinates and the footprint around it; zero width without filtering.
struct Lookup {
  Vec2 at, covered;
};

/// The lookup for the surface coordinates `uv` and `width` of them.
inline Lookup lookup(const Texture& texture, const Vec2& uv, const Vec2& width) {
  const auto near = [](double x) { return std::clamp(x, -coordinate_reach, coordinate_reach); };
  const Vec2 at{near(uv.x * texture.scale.x + texture.offset.x), near(uv.y * texture.scale.y + texture.offset.y)};
  if (texture.filter != Texture::Filter::mipmap) return {at, {}};
  return {at, {near(width.x * std::abs(texture.scale.x)), near(width.y * std::abs(texture.scale.y))}};
}

/// Mean over the footprint. `image` is the image of an ImageTexture, null for patterns; `wraps` overrides the texture's
/// wrap mode.
inline Color texture_color(const Texture& texture, const Lookup& place, const ImageMap* image, const Wraps& wraps) {
  const auto& [at, covered] = place;
  if (image != nullptr) {
    if (texture.filter == Texture::Filter::mipmap) return image->trilinear(at, covered, wraps);
    return texture.filter == Texture::Filter::bilinear ? image->bilinear(at, wraps) : image->nearest(at, wraps);
  }
  if (const auto* checker = std::get_if<CheckerTexture>(&texture.pattern))
    return pattern_color(*checker, at, covered, wraps.v);
  if (const auto* gradient = std::get_if<GradientTexture>(&texture.pattern))
    return pattern_color(*gradient, at, covered, wraps.v);
  return pattern_color(std::get<NoiseTexture>(texture.pattern), at, covered, wraps.v);
}

/// Color of `texture` at the surface coordinates `uv`, filtered over the footprint `width` if its filter is mipmap.
inline Color texture_color(const Texture& texture, const Vec2& uv, const Vec2& width = {},
                           const ImageMap* image = nullptr) {
  return texture_color(texture, lookup(texture, uv, width), image, {texture.wrap, texture.wrap});
}

/// Upper bound of the channels of any lookup: filtering only averages.
inline double texture_bound(const Texture& texture, const ImageMap* image) {
  if (image != nullptr) {
    const std::vector<float>& texels = image->levels().front().rgb;
    return texels.empty() ? 0 : *std::max_element(texels.begin(), texels.end());
  }
  const auto& colors = std::visit(
      [](const auto& pattern) -> std::array<Color, 2> {
        if constexpr (std::is_same_v<std::decay_t<decltype(pattern)>, ImageTexture>)
          return {};
        else
          return pattern.colors;
      },
      texture.pattern);
  return std::max(max_component(colors[0]), max_component(colors[1]));
}

}  // namespace tracer
