#pragma once
/// Cache key of a scene's geometry.

#include <optional>
#include <string>
#include <vector>

#include "tracer/scene.h"
#include "tracer/src/accel/geometry.h"

namespace tracer {

/// SHA-256 of all objects and prototypes, with `contents` (tracer/scene_cache.h) in place of mesh files: equal only for
/// scenes with the same geometry. Empty if the content of a mesh file is unknown, or if there are so few shapes that
/// building them is faster than hashing.
std::optional<std::string> geometry_hash(const Scene& scene, const std::vector<std::string>& contents);

/// Removes the file names of meshes whose triangles are already in `geometry`. The meshes stay empty, and `smooth` is
/// set to whether they have normals, because `requirements` uses it.
void replace_file_meshes(Scene& scene, const GeometrySet& geometry);

}  // namespace tracer
