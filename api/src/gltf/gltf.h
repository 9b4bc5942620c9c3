#pragma once
/// glTF 2.0 files (JSON or GLB) to meshes: Khronos, "glTF 2.0 specification", 2021; sections are cited where they
/// decide.

#include <cstdint>
#include <span>
#include <string>

#include "tracer/limits.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace api::gltf {

/// By the first bytes: GLB's magic, or a JSON object.
bool is_gltf(std::span<const std::uint8_t> bytes);

/// All triangles of the file's scene (else of all nodes, else of all meshes), where its nodes put them, in one mesh:
/// positions, normals, and the first texture coordinates, turned so that v = 0 is the lower edge of an image (in glTF
/// it is the upper). It keeps what `validate` asks of meshes. Parts without normals get those of their faces where
/// other parts have them. Left out: points and lines, materials, colours, animations; skins and morph targets rest.
/// Buffers are the GLB's own chunk or base64 in `data:` URIs: no other file is opened.
/// Fails with a sentence that begins with the byte, or the JSON pointer within the file, that it is about: what is no
/// such file, truncated, out of range, not finite, beyond `limits`, or needs an extension or sparse accessors.
/// Time is linear in the file and the triangles that it comes to (but for sorting); memory is a small multiple of both.
/// Nodes make a tree of any depth: nothing is recursive.
tracer::Result<tracer::Mesh, std::string> read_gltf(std::span<const std::uint8_t> bytes, const tracer::Limits& limits);

}  // namespace api::gltf
