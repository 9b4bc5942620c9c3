#pragma once
/// Bounds of colors before files of images are read.

#include <variant>

#include "tracer/scene.h"
#include "tracer/src/textures/texture.h"

namespace tracer {

/// Upper bound of a color, if `image` is that of image files and of textures that do not exist: 1, white, or 0 for all
/// that is certain before they are read.
inline Color bound_before_reading(const Scene& scene, const ColorOrTexture& color, double image) {
  const auto* id = std::get_if<TextureId>(&color);
  if (id == nullptr) return std::get<Color>(color);
  const bool is_image =
      id->index >= scene.textures.size() || std::holds_alternative<ImageTexture>(scene.textures[id->index].pattern);
  const double factor = id->index < scene.textures.size() ? max_component(scene.textures[id->index].factor) : 1;
  const double bound = is_image ? image * factor : texture_bound(scene.textures[id->index], nullptr);
  return {bound, bound, bound};
}

}  // namespace tracer
