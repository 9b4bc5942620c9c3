#pragma once
/// What a scene's geometry is known by before it is made.

#include <optional>
#include <string>
#include <vector>

#include "tracer/scene.h"
#include "tracer/src/accel/geometry.h"

namespace tracer {

/// Equal only for scenes whose shapes rays cannot tell apart: the digest of all objects and prototypes, with the names
/// of `contents` for files of meshes (tracer/scene_cache.h). Nothing where one of these is not known, or where the
/// shapes are so few that they are placed sooner than looked up.
std::optional<std::string> geometry_hash(const Scene& scene, const std::vector<std::string>& contents);

/// The files of meshes need not be read, for `geometry` is what they came to: meshes name none any more. They stay
/// empty, but `smooth` tells whether they have normals, for `requirements` asks for that.
void stand_in_for_files(Scene& scene, const GeometrySet& geometry);

}  // namespace tracer
