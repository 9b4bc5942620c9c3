#pragma once
/// The triangles of a glTF file's meshes.

#include <cstdint>
#include <vector>

#include "api/src/gltf/file.h"
#include "tracer/limits.h"
#include "tracer/scene.h"

namespace api::gltf {

/// A part of a mesh (section 3.7.2), its accessors found and held against each other.
struct Primitive {
  enum class Mode : std::uint8_t { triangles = 4, strip = 5, fan = 6 };
  Mode mode = Mode::triangles;
  const Accessor* positions = nullptr;
  const Accessor* normals = nullptr;  ///< null: none; so for the others
  const Accessor* uvs = nullptr;
  const Accessor* indices = nullptr;
  Cursor at{};  ///< for what is wrong with its values; the cursors around it live with the mesh

  [[nodiscard]] std::uint64_t triangles() const;
};

/// Those of one mesh that have a surface. Not to be moved once read: the primitives point at `array`.
struct MeshParts {
  std::optional<Cursor> array;
  std::vector<Primitive> primitives;
};

bool read_primitives(File& file, const Cursor& mesh, MeshParts& parts);

/// Appends the part where `world_from_node` puts it: vertices that its triangles use, and none else. False where a
/// value is not finite or out of range.
bool place_primitive(File& file, const Primitive& primitive, const tracer::Transform& world_from_node,
                     const tracer::Limits& limits, tracer::Mesh& mesh);

}  // namespace api::gltf
