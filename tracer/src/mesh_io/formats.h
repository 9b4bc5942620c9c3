#pragma once
/// The readers of mesh files, one a format, and how a file is told; see tracer/mesh_file.h for what they keep. Each
/// fails with a sentence that begins with the place.

#include <cstdint>
#include <span>
#include <string>

#include "tracer/limits.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer::mesh_io {

using Bytes = std::span<const std::uint8_t>;
using MeshOrRefusal = Result<Mesh, std::string>;

/// Wavefront OBJ, "Object Files (.obj)", Advanced Visualizer manual, appendix B1. The first word that is no comment is
/// a keyword of it.
bool is_obj(Bytes bytes);
MeshOrRefusal read_obj(Bytes bytes, const Limits& limits, bool smooth);

/// G. Turk, "The PLY polygon file format", 1994.
bool is_ply(Bytes bytes);
MeshOrRefusal read_ply(Bytes bytes, const Limits& limits);

/// 3D Systems, StereoLithography interface specification, 1989. Binary files are told by their size, for many begin
/// with the word of the ASCII ones.
bool is_binary_stl(Bytes bytes);
MeshOrRefusal read_binary_stl(Bytes bytes, const Limits& limits);
bool is_ascii_stl(Bytes bytes);
MeshOrRefusal read_ascii_stl(Bytes bytes, const Limits& limits);

}  // namespace tracer::mesh_io
