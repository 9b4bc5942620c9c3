#pragma once
/// Detail of textures between samples and within pixels.

#include <array>
#include <cmath>
#include <cstdint>

#include "tracer/src/textures/texture.h"

namespace tracer {

/// Cell of a texture without filter, modulo 2^16: colors are equal, or interpolated, over cells that touch. Texels of
/// an image, squares of a checker, the smallest features of a noise. Indices of cells with one color each are doubled,
/// so that no two of them touch.
inline std::array<std::uint16_t, 2> texture_cell(const Texture& texture, const Vec2& at, const Vec2& cells,
                                                 bool is_image) {
  const bool separate =
      is_image ? texture.filter == Texture::Filter::nearest : !std::holds_alternative<NoiseTexture>(texture.pattern);
  const auto index = [&](double coordinate) {
    const double cell = std::fmod(std::floor(coordinate) * (separate ? 2 : 1), 65536);
    return static_cast<std::uint16_t>(static_cast<std::int32_t>(cell));
  };
  return {index(at.x * cells.x), index(at.y * cells.y)};
}

/// Adds to the signature of a sample what a texture may show beside it, over the footprint `width` of its pixel: the
/// cell of large cells, and of small ones the difference from the mean over the pixel, as if it were the radiance. Of a
/// texture with a filter, that its cells are small: further samples vary more than the image shows. `image` as for
/// texture_color().
template <class Signature>
void add_texture(Signature& signature, const Texture& texture, const Vec2& uv, const Vec2& width,
                 const ImageMap* image) {
  if (std::holds_alternative<GradientTexture>(texture.pattern)) return;
  const Vec2 at = lookup(texture, uv, {}).at,
             covered{std::abs(width.x * texture.scale.x), std::abs(width.y * texture.scale.y)};
  Vec2 cells{1, 1};
  if (image != nullptr)
    cells = {static_cast<double>(image->levels().front().width), static_cast<double>(image->levels().front().height)};
  const auto* noise = std::get_if<NoiseTexture>(&texture.pattern);
  if (noise != nullptr) cells.x = cells.y = std::ldexp(1.0, static_cast<int>(noise->octaves));
  const bool filtered = texture.filter == Texture::Filter::mipmap;
  if (covered.x * cells.x < 1 && covered.y * cells.y < 1) {
    if (!filtered) signature.cell = texture_cell(texture, at, cells, image != nullptr);
    return;
  }
  if (filtered) {
    signature.secondary = static_cast<std::uint16_t>(signature.secondary + 1);
    return;
  }
  const Wraps wraps{texture.wrap, texture.wrap};
  const Color own = texture_color(texture, {at, {}}, image, wraps),
              mean = image != nullptr ? image->trilinear(at, covered, wraps) * texture.factor
                                      : texture_color(texture, {at, covered}, nullptr, wraps);
  double difference = 0;  // with a gamma of 2, close enough to the display's
  for (const auto channel : {&Color::r, &Color::g, &Color::b})
    difference = std::max(difference,
                          std::abs(std::sqrt(std::max(0.0, own.*channel)) - std::sqrt(std::max(0.0, mean.*channel))));
  signature.detail = static_cast<std::uint8_t>(std::min(255.0, std::round(255 * difference)));
}

}  // namespace tracer
