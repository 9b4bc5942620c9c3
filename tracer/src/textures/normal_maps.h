#pragma once
/// Which images hold normals.

#include <vector>

#include "tracer/scene.h"

namespace tracer {

/// Makes linear the textures that normal maps name and that tell no colour space. One that is also seen as a colour or
/// a height stays as it is, and its normal maps get a copy behind the others.
void read_normal_maps_as_linear(const Background& background, std::vector<Material>& materials,
                                std::vector<Texture>& textures);

}  // namespace tracer
