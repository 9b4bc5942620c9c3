#pragma once
/// Writers of small glTF files for the tests of their reader.

#include <string>

#include "tests/support/mesh_files.h"

namespace gltf_files {

using mesh_files::Bytes;

std::string base64(const Bytes& bytes);

/// The pyramid of mesh_files.h: positions, normals and uvs interleaved in rows of 32 bytes (v downwards, as in glTF),
/// then its indices as uint16.
Bytes pyramid_buffer();

/// The members "buffers", "bufferViews", "accessors" (0 positions, 1 normals, 2 uvs, 3 indices) and "meshes" (one, of
/// all of them) of the pyramid; `uri` as JSON ("\"uri\": \"data:...\", ") or empty.
std::string pyramid_members(const std::string& uri);

/// A file with the version and `members` only.
std::string gltf(const std::string& members);
/// The file of the pyramid, with its buffer in a data: URI and with further members (", \"nodes\": [...]").
std::string pyramid_gltf(const std::string& further = "");
Bytes glb(const std::string& json, const Bytes& binary);
Bytes pyramid_glb(const std::string& further = "");

}  // namespace gltf_files
