#pragma once
/// Where the nodes of a glTF file put its meshes.

#include <cstdint>
#include <vector>

#include "api/src/gltf/file.h"
#include "tracer/scene.h"

namespace api::gltf {

struct Placement {
  std::uint32_t mesh = 0;
  tracer::Transform world_from_node{};
};

/// In the order of a walk through the scene's tree, parents first. Each node is placed once at most: one that is
/// reached twice, in a circle or from two parents, is an error (section 3.5.2).
bool read_placements(File& file, std::vector<Placement>& placements);

}  // namespace api::gltf
