#pragma once
/// Reads glTF 2.0 files (JSON or GLB) as meshes: Khronos, "glTF 2.0 specification", 2021, whose sections are cited.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tracer/limits.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace api::gltf {

/// True if the file begins with GLB's magic or a JSON object.
bool is_gltf(std::span<const std::uint8_t> bytes);

struct Source {
  std::span<const std::uint8_t> bytes;
  std::span<const std::span<const std::uint8_t>> buffers{};  ///< contents of the buffers that are files of their own
  std::optional<double> time{};  ///< seconds of the first animation; none: the pose of the nodes
};

/// All triangles of the file's scene (else of all nodes, else of all meshes), transformed by its nodes, as one mesh:
/// positions, normals, and the first texture coordinates, with v = 0 at the lower edge of an image (in glTF it is the
/// upper). The names of materials make parts; one without a name is "#" and its index. The mesh satisfies `validate`.
/// If only some parts have normals, the others get those of their faces. Skins and morph targets are applied. Omitted:
/// points and lines, the materials themselves, colors. Buffers are the GLB's own chunk, base64 in `data:` URIs, or
/// `buffers` in their order: no other file is opened. Fails with a sentence that begins with the position or the JSON
/// pointer of the error within the file: no glTF, truncated, out of range, not finite, beyond `limits`, or in need of
/// an extension. Time is linear in the file and its triangles (except for sorting); memory is a
/// small multiple of both. Trees of nodes may have any depth: there is no recursion.
tracer::Result<tracer::Mesh, std::string> read_gltf(const Source& source, const tracer::Limits& limits);

/// The file of an image within a glTF file. Fails as read_gltf().
tracer::Result<std::vector<std::uint8_t>, std::string> read_image(std::span<const std::uint8_t> bytes,
                                                                  std::uint32_t image);

}  // namespace api::gltf
