#pragma once
/// Placement of meshes by the nodes of a glTF file.

#include <cstdint>
#include <vector>

#include "api/src/gltf/file.h"
#include "tracer/scene.h"

namespace api::gltf {

struct Placement {
  std::uint32_t mesh = 0;
  tracer::Transform world_from_node{};
};

/// In the order of a walk through the scene's tree, parents first; without nodes, each mesh once. A node that is
/// reached twice, in a cycle or from two parents, is an error (section 3.5.2). The caller checks file.failed().
std::vector<Placement> read_placements(File& file);

}  // namespace api::gltf
