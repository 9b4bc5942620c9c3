#pragma once
/// One reader per mesh format, and format detection; see tracer/mesh_file.h. Each reader fails with a sentence that
/// begins with the position.

#include <cstdint>
#include <span>
#include <string>

#include "tracer/limits.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer::mesh_io {

using Bytes = std::span<const std::uint8_t>;
using MeshResult = Result<Mesh, std::string>;

/// Wavefront OBJ, "Object Files (.obj)", Advanced Visualizer manual, appendix B1. Detected if the first token outside
/// of comments is one of its keywords.
bool is_obj(Bytes bytes);
MeshResult read_obj(Bytes bytes, const Limits& limits, bool smooth);

/// G. Turk, "The PLY polygon file format", 1994.
bool is_ply(Bytes bytes);
MeshResult read_ply(Bytes bytes, const Limits& limits);

/// 3D Systems, StereoLithography interface specification, 1989. Binary files are detected by their size, because many
/// begin with the keyword of ASCII files.
bool is_binary_stl(Bytes bytes);
MeshResult read_binary_stl(Bytes bytes, const Limits& limits);
bool is_ascii_stl(Bytes bytes);
MeshResult read_ascii_stl(Bytes bytes, const Limits& limits);

}  // namespace tracer::mesh_io
