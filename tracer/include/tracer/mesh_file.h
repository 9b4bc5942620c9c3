#pragma once
/// Mesh files to meshes: OBJ, PLY (ASCII, binary of either byte order) and STL (ASCII, binary).
///
/// Readers of our own, for what they must do is little and what they are given is anybody's: they open nothing else,
/// check every declared size against the bytes that are there before they take memory for it, and every index against
/// what it points at. Time is linear in the bytes but for sorting; memory is a small multiple of them: about ten times
/// for files as programs write them, at most fifty.

#include <cstdint>
#include <span>
#include <string>

#include "tracer/limits.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

/// The mesh of the whole file (`smooth` is as it is given), told by its content whatever its name is; it has triangles,
/// keeps what `validate` asks of meshes, and no position that no triangle has. Polygons are cut as `triangulate` does.
/// Not read: materials, colours, groups, lines and points; texture coordinates that PLY keeps by face.
/// - OBJ: a vertex for each combination of position, uv and normal. Where other corners have a normal, one without gets
///   its face's; one without a uv gets (0, 0). A file that has uvs and no normals gets them here where `smooth`
///   asks: of its positions, or surfaces would show a seam wherever the uvs have one.
/// - PLY: elements `vertex` (x y z, nx ny nz, and u v, s t or texture_u texture_v) and `face` (a list vertex_indices or
///   vertex_index) or `tristrips` (the same, -1 between strips), of any types and in any order; others are skipped.
/// - STL: equal positions become one vertex, so that `smooth` finds neighbours; its normals are those of the faces and
///   are not kept.
/// Fails with a sentence that begins with the line, byte or face it is about: what is no such file, truncated,
/// malformed, not finite, out of range, or beyond `limits` (triangles, coordinate_max, value_max for uvs).
Result<Mesh, std::string> read_mesh_file(std::span<const std::uint8_t> bytes, const Limits& limits, bool smooth);

/// Gives corners whose normal has no direction (shorter than `limits.length_min`) that of their face, with vertices of
/// their own where faces differ. For readers of files that know normals only in places; none at all stay none.
/// Precondition: as many normals as positions, or none.
void give_missing_normals(Mesh& mesh, const Limits& limits);

}  // namespace tracer
