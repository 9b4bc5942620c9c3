#include "tests/reader/gltf_files.h"

namespace gltf_files {

std::string base64(const Bytes& bytes) {
  constexpr std::string_view alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) bits = bits << 8U | (i + k < bytes.size() ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += i + k > bytes.size() ? '=' : alphabet[bits >> (18 - 6 * k) & 63U];
  }
  return text;
}

Bytes pyramid_buffer() {
  const tracer::Mesh mesh = mesh_files::pyramid();
  Bytes bytes;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const auto &p = mesh.positions[i], &n = mesh.normals[i];
    for (const double value : {p.x, p.y, p.z, n.x, n.y, n.z, mesh.uvs[i].x, 1 - mesh.uvs[i].y})
      mesh_files::append(bytes, static_cast<float>(value));
  }
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle) mesh_files::append(bytes, static_cast<std::uint16_t>(corner));
  return bytes;
}

std::string pyramid_members(const std::string& uri) {
  return R"("buffers": [{)" + uri + R"("byteLength": 196}],
"bufferViews": [{"buffer": 0, "byteLength": 160, "byteStride": 32}, {"buffer": 0, "byteOffset": 160, "byteLength": 36}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3"},
 {"bufferView": 0, "byteOffset": 12, "componentType": 5126, "count": 5, "type": "VEC3"},
 {"bufferView": 0, "byteOffset": 24, "componentType": 5126, "count": 5, "type": "VEC2"},
 {"bufferView": 1, "componentType": 5123, "count": 18, "type": "SCALAR"}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3}]}])";
}

std::string gltf(const std::string& members) { return R"({"asset": {"version": "2.0"}, )" + members + "}"; }

std::string pyramid_gltf(const std::string& further) {
  const std::string uri = R"("uri": "data:application/octet-stream;base64,)" + base64(pyramid_buffer()) + "\", ";
  return gltf(pyramid_members(uri) + further);
}

Bytes glb(const std::string& json, const Bytes& binary) {
  const std::string padded = json + std::string((4 - json.size() % 4) % 4, ' ');
  Bytes bytes = mesh_files::bytes_of("glTF");
  mesh_files::append(bytes, std::uint32_t{2});
  mesh_files::append(bytes, static_cast<std::uint32_t>(12 + 8 + padded.size() + 8 + binary.size()));
  mesh_files::append(bytes, static_cast<std::uint32_t>(padded.size()));
  for (const std::string& part : {std::string("JSON"), padded}) bytes.insert(bytes.end(), part.begin(), part.end());
  mesh_files::append(bytes, static_cast<std::uint32_t>(binary.size()));
  for (const char c : {'B', 'I', 'N', '\0'}) bytes.push_back(static_cast<std::uint8_t>(c));
  bytes.insert(bytes.end(), binary.begin(), binary.end());
  return bytes;
}

Bytes pyramid_glb(const std::string& further) { return glb(gltf(pyramid_members("") + further), pyramid_buffer()); }

}  // namespace gltf_files
