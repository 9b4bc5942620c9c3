#pragma once
/// The triangles of a glTF file's meshes.

#include <cstdint>
#include <vector>

#include "api/src/gltf/file.h"
#include "tracer/limits.h"
#include "tracer/scene.h"

namespace api::gltf {

/// A part of a mesh (section 3.7.2), with its accessors.
struct Primitive {
  enum class Mode : std::uint8_t { triangles = 4, strip = 5, fan = 6 };
  Mode mode = Mode::triangles;
  const Accessor* positions = nullptr;
  const Accessor* normals = nullptr;  ///< null: none; the same for the following ones
  const Accessor* uvs = nullptr;
  const Accessor* indices = nullptr;
  const Accessor *joints = nullptr, *weights = nullptr;  ///< those of a skin
  struct MorphTarget {
    const Accessor *positions = nullptr, *normals = nullptr;  ///< differences
  };
  std::vector<MorphTarget> targets{};
  std::string material;  ///< its name, or "#3" for the one at index 3 if it has none; empty: there is no material
  Cursor at{};           ///< for errors in its values

  [[nodiscard]] std::uint64_t triangles() const;
};

/// The parts of a mesh that have a surface.
std::vector<Primitive> read_primitives(File& file, const Cursor& mesh);

/// Appends the part at its place, deformed by morph targets and then by its skin, with the vertices that its triangles
/// use.
void append_primitive(const Primitive& primitive, const Placement& placement, const tracer::Limits& limits,
                      tracer::Mesh& mesh);

}  // namespace api::gltf
