#pragma once
/// The second half of load_assets.h: meshes of files become meshes like any others.

#include <vector>

#include "tracer/assets.h"
#include "tracer/limits.h"
#include "tracer/scene.h"
#include "tracer/validate.h"

namespace api {

/// Reads the file of each mesh of `scene` (objects and prototypes) that has one: OBJ, PLY, STL, glTF or GLB, told by
/// content (tracer/mesh_file.h and src/gltf/gltf.h say what of each). Each file is read once for the meshes
/// that are `smooth` and once for the others, however many they are.
/// Empty: `scene` has no meshes of files any more, and passes `validate`, counts included. Otherwise everything that is
/// wrong, "bad_asset" at the first mesh of each file that cannot be read (the sentence begins with the file's name,
/// then the place in it), or else what `validate` says of the whole; the scene is then good for nothing. Precondition:
/// `validate` found nothing in `scene`. Never throws; any bytes.
std::vector<tracer::Issue> load_meshes(tracer::Scene& scene, const tracer::Assets& assets,
                                       const tracer::Limits& limits);

}  // namespace api
