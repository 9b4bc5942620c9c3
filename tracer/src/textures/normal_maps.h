#pragma once
/// Color space of normal maps.

#include <vector>

#include "tracer/scene.h"

namespace tracer {

/// Sets the color space of textures used as normal maps to linear if they have none. A texture that is also used as a
/// color or a height is unchanged, and normal maps use a copy appended to `textures`.
void read_normal_maps_as_linear(const Background& background, std::vector<Material>& materials,
                                std::vector<Texture>& textures);

}  // namespace tracer
