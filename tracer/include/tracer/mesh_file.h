#pragma once
/// Reads mesh files: OBJ, PLY (ASCII, binary of either byte order) and STL (ASCII, binary).
///
/// The readers are safe for untrusted input: they open no other file, check every declared size against the bytes that
/// are present before they allocate, and check every index. Time is linear in the bytes except for sorting; memory is
/// about ten times the bytes for usual files, at most fifty times.

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "tracer/limits.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

/// Reads the whole file as one mesh with the given `smooth`. The format is detected from the content. The mesh has at
/// least one triangle, no unused position, and passes `validate`. Polygons are cut by `triangulate`. The names of OBJ's
/// `usemtl` make parts. Ignored: material files, colors, groups, lines, points, and per-face texture coordinates of
/// PLY.
/// - OBJ: one vertex per combination of position, uv and normal. If other corners have a normal, a corner without gets
///   its face's; a corner without uv gets (0, 0). For a file with uvs and no normals, `smooth` computes the normals
///   here per position: computed per vertex they would show a seam at every uv seam.
/// - PLY: elements `vertex` (x y z, nx ny nz, and u v, s t or texture_u texture_v) and `face` (a list vertex_indices or
///   vertex_index) or `tristrips` (the same list, -1 between strips), of any types and in any order; others are
///   skipped.
/// - STL: equal positions become one vertex, so that `smooth` finds neighbors; its normals are per face and not kept.
/// Fails with a sentence that begins with the line, byte or face: not a mesh file, truncated, malformed, not finite,
/// out of range, or beyond `limits` (triangles, coordinate_max, value_max for uvs).
Result<Mesh, std::string> read_mesh_file(std::span<const std::uint8_t> bytes, const Limits& limits, bool smooth);

/// Begins a part at the next triangle if the material's name changes there; empty: none.
void begin_part(Mesh& mesh, const std::string& name);

/// Area-weighted vertex normals: the cross product of two edges is twice the area times the unit normal
/// (Gouraud 1971; weights compared by Max 1999). Vertices whose sum vanishes stay zero.
std::vector<Vec3> area_weighted_normals(const Mesh& mesh);

/// The triangles of a mesh for each material, in the order of their first ones, with the vertices that they use and
/// the same normals at the borders as before. The parts have no parts and no file. `material_of(name)`: of a part.
struct MaterialMesh {
  MaterialId material;
  Mesh mesh;
};
std::vector<MaterialMesh> split_by_material(Mesh mesh, const std::function<MaterialId(const std::string&)>& material_of,
                                            const Limits& limits);

/// Replaces normals shorter than `limits.length_min` by the face normal, duplicating vertices whose faces differ. A
/// mesh without normals stays without. Precondition: as many normals as positions, or none.
void add_missing_normals(Mesh& mesh, const Limits& limits);

}  // namespace tracer
